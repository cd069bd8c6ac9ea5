"""Reading files of points and triangles: PCD, PLY, OBJ, STL, DAE, XYZ and NPZ, each checked to the last byte.

Open3D answers a missing or broken file with an empty cloud, so all formats but DAE are read here.
"""

import struct
from collections.abc import Callable
from pathlib import Path
from typing import Final

import numpy as np

from ersatz.acquisition.clouds import Cloud
from ersatz.acquisition.extras import open3d
from ersatz.acquisition.pcd_files import read_pcd
from ersatz.acquisition.ply_files import fans, read_ply
from ersatz.errors import ScanError


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
    return Cloud(np.array(points, dtype=np.float64), fans(faces) if faces else None)


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
    ".pcd": read_pcd,
    ".ply": read_ply,
    ".obj": _read_obj,
    ".stl": _read_stl,
    ".dae": _read_dae,
    ".xyz": _read_xyz,
    ".txt": _read_xyz,
    ".npz": _read_npz,
}
"""Readers of files that hold points or triangles, by suffix."""
