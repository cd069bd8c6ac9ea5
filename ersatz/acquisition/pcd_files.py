"""Reading PCD, the files of the Point Cloud Library: text, binary and compressed."""

import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ersatz.acquisition.clouds import MOST_POINTS, Cloud, columns, records, split_header, triple
from ersatz.errors import ScanError


def read_pcd(path: Path) -> Cloud:
    """Return the points of a PCD file, with normals, colours and viewpoint where it has them."""
    lines, body = split_header(path.read_bytes(), b"DATA")
    header = {words[0]: words[1:] for words in lines}
    names = header["FIELDS"]
    sizes, kinds = list(map(int, header["SIZE"])), header["TYPE"]
    counts = list(map(int, header.get("COUNT", ["1"] * len(names))))
    if not len(names) == len(sizes) == len(kinds) == len(counts):
        raise ScanError(
            f"{len(names)} fields, but {len(sizes)} sizes, {len(kinds)} types and {len(counts)} counts "
            "in the header"
        )
    count = int(header["WIDTH"][0]) * int(header["HEIGHT"][0])
    if "POINTS" in header and int(header["POINTS"][0]) != count:
        raise ScanError(f"POINTS {header['POINTS'][0]} is not WIDTH x HEIGHT = {count}")
    if not 0 <= count <= MOST_POINTS:
        raise ScanError(f"{count} points announced, at most {MOST_POINTS} are read")
    formats = [f"<{kind.lower()}{size}" for kind, size in zip(kinds, sizes, strict=True)]
    for name, kind in zip(names, formats, strict=True):
        if kind[1:] not in {"f4", "f8", "i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8"}:
            raise ScanError(f"field {name!r} has an impossible type and size {kind[1:]!r}")
    layout = list(zip(names, formats, counts, strict=True))
    fields = _pcd_fields(header["DATA"][0], body, count, layout)
    points = triple(fields)
    if points is None:
        raise ScanError(f"no fields x, y, z among {names}")
    colours = None
    if "rgb" in fields and fields["rgb"].dtype.itemsize == 4:
        packed = fields["rgb"].view(np.uint32)
        colours = np.stack([packed >> 16 & 255, packed >> 8 & 255, packed & 255], axis=1) / 255
    viewpoint = np.array(header.get("VIEWPOINT", ["0", "0", "0"])[:3], dtype=np.float64)
    return Cloud(points, None, triple(fields, "normal_x normal_y normal_z"), colours, viewpoint)


def _pcd_fields(
    coding: str, body: bytes, count: int, layout: list[tuple[str, str, int]]
) -> dict[str, NDArray[Any]]:
    names, formats, counts = zip(*layout, strict=True)
    if coding == "ascii":
        table = columns(body, count, sum(counts))
        starts = np.cumsum([0, *counts[:-1]])
        return {n: table[:, s].astype(f) for n, s, f in zip(names, starts, formats, strict=True)}
    # Padding fields are all called "_": numpy wants names that differ.
    unique = [f"{name} {i}" for i, name in enumerate(names)]
    shapes = zip(unique, formats, counts, strict=True)
    if coding == "binary":
        rows = records(body, count, np.dtype([(n, f, (c,)) for n, f, c in shapes]))
        return {n: np.ascontiguousarray(rows[u][:, 0]) for n, u in zip(names, unique, strict=True)}
    if coding != "binary_compressed":
        raise ScanError(f"DATA {coding!r} is none of ascii, binary, binary_compressed")
    packed, unpacked = struct.unpack_from("<II", body)
    needed = count * sum(np.dtype(f).itemsize * c for f, c in zip(formats, counts, strict=True))
    if unpacked != needed or len(body) < 8 + packed:
        raise ScanError(
            f"truncated: {needed} bytes announced, {unpacked} packed into {packed} of {len(body) - 8}"
        )
    plain = _lzf(body[8 : 8 + packed], unpacked)
    fields, start = {}, 0
    for name, kind, width in zip(names, formats, counts, strict=True):
        end = start + count * width * np.dtype(kind).itemsize
        fields[name] = np.frombuffer(plain[start:end], kind).reshape(count, width)[:, 0].copy()
        start = end
    return fields


def _lzf(packed: bytes, size: int) -> bytes:
    """Undo LibLZF, the compression of `binary_compressed`."""
    plain = bytearray()
    i = 0
    while i < len(packed):
        control = packed[i]
        i += 1
        if control < 32:
            plain += packed[i : i + control + 1]
            i += control + 1
            continue
        length = control >> 5
        if length == 7:
            length += packed[i]
            i += 1
        back = len(plain) - ((control & 31) << 8) - packed[i] - 1
        i += 1
        if back < 0:
            raise ScanError("the compressed data refer to bytes before their start")
        length += 2
        chunk = plain[back : back + length]
        plain += (chunk * (length // max(len(chunk), 1) + 1))[:length]
    if len(plain) != size:
        raise ScanError(f"the compressed data unpack to {len(plain)} bytes instead of {size}")
    return bytes(plain)
