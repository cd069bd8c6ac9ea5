"""Reading PLY, text and binary, with faces of any number of corners."""

from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ersatz.acquisition.clouds import MOST_POINTS, Cloud, columns, records, split_header, triple
from ersatz.errors import ScanError

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


def read_ply(path: Path) -> Cloud:
    """Return the vertices and faces of a PLY file, with normals and colours where it has them."""
    data = path.read_bytes()
    if not data.startswith(b"ply"):
        raise ScanError("it does not begin with 'ply'")
    lines, body = split_header(data, b"end_header")
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
    points = triple(fields)
    if points is None:
        raise ScanError(f"no vertex properties x, y, z among {sorted(fields)}")
    colours = triple(fields, "red green blue")
    if colours is not None and fields["red"].dtype.kind == "u":
        colours = colours / np.iinfo(fields["red"].dtype).max
    return Cloud(points, triangles, triple(fields, "nx ny nz"), colours)


def _ply_scalars(
    body: bytes, count: int, kinds: list[tuple[str, str]], coding: str
) -> tuple[dict[str, NDArray[Any]], bytes]:
    if coding == "ascii":
        lines = body.split(b"\n", count)
        table = columns(b"\n".join(lines[:count]), count, len(kinds))
        rest = lines[count] if len(lines) > count else b""
        return {name: table[:, i].astype(kind) for i, (name, kind) in enumerate(kinds)}, rest
    dtype = np.dtype(kinds)
    rows = records(body, count, dtype)
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
        return fans([[int(w) for w in line.split()] for line in lines[:count]]), b"\n".join(lines[count:])
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
        corners = int(records(body[start : start + 8], 1, np.dtype(size))[0])
        start += np.dtype(size).itemsize
        end = start + corners * np.dtype(index).itemsize
        faces.append([corners, *records(body[start:end], corners, np.dtype(index)).tolist()])
        start = end + after
    return fans(faces), body[start:]


def fans(faces: list[list[int]]) -> NDArray[np.int64]:
    """Return triangles from faces of any number of corners, each row (corners, first, second, ...)."""
    triangles = []
    for size, *corners in faces:
        if size < 3 or len(corners) < size:
            raise ScanError(f"a face announces {size} corners and has {len(corners)}")
        triangles += [(corners[0], corners[i], corners[i + 1]) for i in range(1, size - 1)]
    return np.array(triangles, dtype=np.int64).reshape(-1, 3)
