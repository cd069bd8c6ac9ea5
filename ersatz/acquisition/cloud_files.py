"""Reading files of points and triangles: PCD, PLY, OBJ, STL, DAE, XYZ and NPZ, each checked to the last byte.

Open3D answers a missing or broken file with an empty cloud, so all formats but DAE are read here.
"""

import struct
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ersatz.acquisition.extras import open3d
from ersatz.errors import ScanError

MOST_POINTS: Final = 20_000_000
"""Points a file may hold; a count beyond it is taken for a broken header rather than for a scan."""

PLY_TYPES: Final = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}


@dataclass(frozen=True, slots=True, eq=False)
class Cloud:
    """What a file holds, unchecked.

    Attributes
    ----------
    points : (n, 3) float64 array, in the file's unit
    triangles : (t, 3) int64 array or None
    normals : (n, 3) float64 array or None
    colours : (n, 3) float64 array in [0, 1], or None
    viewpoint : (3,) float64 array or None
        Position of the sensor, in the file's unit, where the format records one.
    """

    points: NDArray[np.float64]
    triangles: NDArray[np.int64] | None = None
    normals: NDArray[np.float64] | None = None
    colours: NDArray[np.float64] | None = None
    viewpoint: NDArray[np.float64] | None = None


def read_cloud(path: Path) -> Cloud:
    """Return what a file of points or triangles holds, by its suffix.

    Raises
    ------
    ScanError
        If the file is missing, of an unknown kind, truncated, or its header contradicts itself.
    MissingDependencyError
        If a DAE file is read without open3d.
    """
    if not path.is_file():
        raise ScanError(f"{path}: there is no such file")
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise ScanError(
            f"{path}: unknown kind of file {path.suffix!r}; known are {', '.join(sorted(READERS))}"
        )
    try:
        return reader(path)
    except ScanError as error:
        raise ScanError(f"{path}: {error}") from error
    except (ValueError, KeyError, IndexError, struct.error, UnicodeDecodeError, EOFError, OSError) as error:
        raise ScanError(f"{path}: not a readable {path.suffix[1:].upper()} file ({error})") from error


def _split_header(data: bytes, last: bytes) -> tuple[list[list[str]], bytes]:
    """Return the words of each header line up to the one that starts with `last`, and the bytes after it."""
    lines: list[list[str]] = []
    start = 0
    while start < len(data):
        end = data.find(b"\n", start)
        end = len(data) if end < 0 else end
        words = data[start:end].decode("ascii").split()
        start = end + 1
        if words and not words[0].startswith("#"):
            lines.append(words)
        if words and words[0] == last.decode():
            return lines, data[start:]
    raise ScanError(f"the header has no line {last.decode()!r}")


def _columns(body: bytes, count: int, width: int) -> NDArray[np.float64]:
    """Return the first `count` rows of a text table as a (count, width) array."""
    rows = body.split()
    if len(rows) < count * width:
        raise ScanError(f"truncated: {count} rows of {width} numbers announced, {len(rows) // width} found")
    return np.array(rows[: count * width], dtype=np.float64).reshape(count, width)


def _records(body: bytes, count: int, dtype: np.dtype[Any]) -> NDArray[Any]:
    """Return `count` binary records."""
    if len(body) < count * dtype.itemsize:
        raise ScanError(
            f"truncated: {count} records of {dtype.itemsize} bytes announced, {len(body)} bytes found"
        )
    return np.frombuffer(body, dtype=dtype, count=count)


def _xyz(fields: dict[str, NDArray[Any]], names: str = "x y z") -> NDArray[np.float64] | None:
    """Return three fields side by side, or None if one is missing."""
    wanted = names.split()
    if not all(name in fields for name in wanted):
        return None
    return np.stack([fields[name].astype(np.float64) for name in wanted], axis=1)


def _read_pcd(path: Path) -> Cloud:
    lines, body = _split_header(path.read_bytes(), b"DATA")
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
    points = _xyz(fields)
    if points is None:
        raise ScanError(f"no fields x, y, z among {names}")
    colours = None
    if "rgb" in fields and fields["rgb"].dtype.itemsize == 4:
        packed = fields["rgb"].view(np.uint32)
        colours = np.stack([packed >> 16 & 255, packed >> 8 & 255, packed & 255], axis=1) / 255
    viewpoint = np.array(header.get("VIEWPOINT", ["0", "0", "0"])[:3], dtype=np.float64)
    return Cloud(points, None, _xyz(fields, "normal_x normal_y normal_z"), colours, viewpoint)


def _pcd_fields(
    coding: str, body: bytes, count: int, layout: list[tuple[str, str, int]]
) -> dict[str, NDArray[Any]]:
    names, formats, counts = zip(*layout, strict=True)
    if coding == "ascii":
        table = _columns(body, count, sum(counts))
        starts = np.cumsum([0, *counts[:-1]])
        return {n: table[:, s].astype(f) for n, s, f in zip(names, starts, formats, strict=True)}
    # Padding fields are all called "_": numpy wants names that differ.
    unique = [f"{name} {i}" for i, name in enumerate(names)]
    shapes = zip(unique, formats, counts, strict=True)
    if coding == "binary":
        rows = _records(body, count, np.dtype([(n, f, (c,)) for n, f, c in shapes]))
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


def _read_ply(path: Path) -> Cloud:
    data = path.read_bytes()
    if not data.startswith(b"ply"):
        raise ScanError("it does not begin with 'ply'")
    lines, body = _split_header(data, b"end_header")
    coding = next(words[1] for words in lines if words[0] == "format")
    order = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}[coding]
    elements: list[tuple[str, int, list[list[str]]]] = []
    for words in lines:
        if words[0] == "element":
            elements.append((words[1], int(words[2]), []))
        elif words[0] == "property":
            elements[-1][2].append(words[1:])
    fields: dict[str, NDArray[Any]] = {}
    triangles = None
    for name, count, properties in elements:
        if not 0 <= count <= MOST_POINTS:
            raise ScanError(f"{count} elements {name!r} announced, at most {MOST_POINTS} are read")
        if name == "vertex":
            kinds = [(words[1], order + PLY_TYPES[words[0]]) for words in properties]
            fields, body = _ply_scalars(body, count, kinds, coding)
        elif name == "face":
            triangles, body = _ply_faces(body, count, properties, order, coding)
        elif triangles is None or not fields:
            raise ScanError(f"element {name!r} before vertices or faces is not understood")
    points = _xyz(fields)
    if points is None:
        raise ScanError(f"no vertex properties x, y, z among {sorted(fields)}")
    colours = _xyz(fields, "red green blue")
    if colours is not None and fields["red"].dtype.kind == "u":
        colours = colours / np.iinfo(fields["red"].dtype).max
    return Cloud(points, triangles, _xyz(fields, "nx ny nz"), colours)


def _ply_scalars(
    body: bytes, count: int, kinds: list[tuple[str, str]], coding: str
) -> tuple[dict[str, NDArray[Any]], bytes]:
    if coding == "ascii":
        lines = body.split(b"\n", count)
        table = _columns(b"\n".join(lines[:count]), count, len(kinds))
        rest = lines[count] if len(lines) > count else b""
        return {name: table[:, i].astype(kind) for i, (name, kind) in enumerate(kinds)}, rest
    dtype = np.dtype(kinds)
    rows = _records(body, count, dtype)
    return {name: rows[name] for name, _ in kinds}, body[count * dtype.itemsize :]


def _ply_faces(
    body: bytes, count: int, properties: list[list[str]], order: str, coding: str
) -> tuple[NDArray[np.int64] | None, bytes]:
    if not count:
        return None, body
    if coding == "ascii":
        lines = body.split(b"\n", count)
        if len(lines) < count or not lines[count - 1].strip():
            raise ScanError(
                f"truncated: {count} faces announced, {len([x for x in lines if x.strip()])} found"
            )
        return _fans([[int(w) for w in line.split()] for line in lines[:count]]), b"\n".join(lines[count:])
    if properties[0][0] != "list" or any(words[0] == "list" for words in properties[1:]):
        raise ScanError(f"faces with the properties {properties} are not understood")
    size, index = order + PLY_TYPES[properties[0][1]], order + PLY_TYPES[properties[0][2]]
    rest = [(f"rest {i}", order + PLY_TYPES[words[0]]) for i, words in enumerate(properties[1:])]
    dtype = np.dtype([("size", size), ("index", index, (3,)), *rest])
    if len(body) >= count * dtype.itemsize:
        rows = np.frombuffer(body, dtype=dtype, count=count)
        if (rows["size"] == 3).all():
            return rows["index"].astype(np.int64), body[count * dtype.itemsize :]
    after = sum(np.dtype(kind).itemsize for _, kind in rest)
    faces, start = [], 0
    for _ in range(count):
        corners = int(_records(body[start : start + 8], 1, np.dtype(size))[0])
        start += np.dtype(size).itemsize
        end = start + corners * np.dtype(index).itemsize
        faces.append([corners, *_records(body[start:end], corners, np.dtype(index)).tolist()])
        start = end + after
    return _fans(faces), body[start:]


def _fans(faces: list[list[int]]) -> NDArray[np.int64]:
    """Return triangles from faces of any number of corners, each row (corners, first, second, ...)."""
    triangles = []
    for size, *corners in faces:
        if size < 3 or len(corners) < size:
            raise ScanError(f"a face announces {size} corners and has {len(corners)}")
        triangles += [(corners[0], corners[i], corners[i + 1]) for i in range(1, size - 1)]
    return np.array(triangles, dtype=np.int64).reshape(-1, 3)


def _read_obj(path: Path) -> Cloud:
    points: list[list[str]] = []
    faces: list[list[int]] = []
    for line in path.read_text(encoding="utf-8", errors="strict").splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            points.append(words[1:4])
        elif words[:1] == ["f"]:
            corners = [int(word.split("/")[0]) for word in words[1:]]
            faces.append([len(corners), *(c - 1 if c > 0 else len(points) + c for c in corners)])
    if not points:
        raise ScanError("no vertex line 'v x y z'")
    return Cloud(np.array(points, dtype=np.float64), _fans(faces) if faces else None)


def _read_stl(path: Path) -> Cloud:
    data = path.read_bytes()
    count = struct.unpack_from("<I", data, 80)[0] if len(data) >= 84 else -1
    if len(data) == 84 + 50 * count:
        rows = np.frombuffer(data, np.dtype([("v", "<f4", (12,)), ("attribute", "<u2")]), count, 84)
        corners = rows["v"][:, 3:].astype(np.float64).reshape(-1, 3)
    elif data.lstrip().startswith(b"solid"):
        words = [line.split() for line in data.decode("ascii").splitlines()]
        if not any(line[:1] == ["endsolid"] for line in words):
            raise ScanError("truncated: no line 'endsolid'")
        corners = np.array([line[1:4] for line in words if line[:1] == ["vertex"]], dtype=np.float64)
    else:
        raise ScanError(f"truncated: {count} triangles announced, {len(data)} bytes found")
    if not len(corners) or len(corners) % 3:
        raise ScanError(f"{len(corners)} corners do not make triangles")
    points, index = np.unique(corners, axis=0, return_inverse=True)
    return Cloud(points, index.reshape(-1, 3).astype(np.int64))


def _read_dae(path: Path) -> Cloud:
    mesh = open3d().io.read_triangle_mesh(str(path))
    points, triangles = np.asarray(mesh.vertices), np.asarray(mesh.triangles, dtype=np.int64)
    if not len(points):
        raise ScanError("no geometry could be read from it")
    return Cloud(points.astype(np.float64), triangles if len(triangles) else None)


def _read_xyz(path: Path) -> Cloud:
    lines = [line.replace(",", " ").split() for line in path.read_text(encoding="utf-8").splitlines()]
    rows = [line for line in lines if line and not line[0].startswith("#")]
    widths = {len(row) for row in rows}
    if len(widths) > 1 or (widths and min(widths) < 3):
        raise ScanError(
            f"every row needs the same three or more numbers; rows of {sorted(widths)} numbers found"
        )
    table = np.array(rows, dtype=np.float64).reshape(len(rows), -1 if rows else 3)
    return Cloud(table[:, :3], None, table[:, 3:6] if table.shape[1] == 6 else None)


def _read_npz(path: Path) -> Cloud:
    # Never unpickled: an object array in the file is an error, not code to run.
    with np.load(path, allow_pickle=False) as stored:
        arrays = {name: np.asarray(stored[name]) for name in stored.files}
    if "points" not in arrays:
        raise ScanError(f"no array 'points' among {sorted(arrays)}")
    given = {
        key: arrays[name].astype(np.float64)
        for key, name in (("normals", "normals"), ("colours", "colours"), ("viewpoint", "sensor"))
        if name in arrays
    }
    triangles = arrays["triangles"].astype(np.int64) if "triangles" in arrays else None
    return Cloud(arrays["points"].astype(np.float64), triangles, **given)


READERS: Final[dict[str, Callable[[Path], Cloud]]] = {
    ".pcd": _read_pcd,
    ".ply": _read_ply,
    ".obj": _read_obj,
    ".stl": _read_stl,
    ".dae": _read_dae,
    ".xyz": _read_xyz,
    ".txt": _read_xyz,
    ".npz": _read_npz,
}
"""Readers of files that hold points or triangles, by suffix."""
