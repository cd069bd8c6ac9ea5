"""Depth images: a PNG of distances and the camera's intrinsics make a scan."""

import hashlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ersatz.acquisition.depth_sensor import Intrinsics
from ersatz.acquisition.extras import open3d
from ersatz.acquisition.scans import Scan, check_extent
from ersatz.errors import ScanError
from ersatz.measurements import Source


def read_image(path: Path) -> NDArray[np.generic]:
    """Return a PNG file as an (h, w) array.

    Raises
    ------
    ScanError
        If it is missing, not a PNG, or has several channels.
    MissingDependencyError
        If open3d is missing.
    """
    if not path.is_file():
        raise ScanError(f"{path}: there is no such file")
    data = path.read_bytes()
    if not data.startswith(b"\x89PNG") or b"IEND" not in data[-16:]:
        raise ScanError(f"{path}: not a complete PNG file")
    image = np.asarray(open3d().io.read_image(str(path)))
    if image.ndim != 2 or not image.size:
        raise ScanError(f"{path}: an image of one channel is needed, not of shape {image.shape}")
    return image


def depth_to_points(
    depth: NDArray[np.float64], intrinsics: Intrinsics, corner: tuple[int, int] = (0, 0)
) -> NDArray[np.float64]:
    """Return the points of a depth image in the camera's frame.

    Parameters
    ----------
    depth : (h, w) array, metres
        Along the optical axis; 0 where nothing was measured.
    intrinsics : Intrinsics
    corner : (int, int), pixels
        Column and row of the image's first pixel in the whole picture, for a cut-out.

    Returns
    -------
    (n, 3) array, metres
        x right, y down, z forward.
    """
    rows, columns = np.nonzero(np.isfinite(depth) & (depth > 0))
    z = depth[rows, columns]
    x = (columns + corner[0] - intrinsics.cx) / intrinsics.fx * z
    y = (rows + corner[1] - intrinsics.cy) / intrinsics.fy * z
    return np.stack([x, y, z], axis=1)


def read_depth_scan(
    path: str | Path,
    intrinsics: Intrinsics | None = None,
    mask: str | Path | None = None,
    *,
    corner: tuple[int, int] | None = None,
    unit: float = 0.001,
) -> Scan:
    """Read one view from a depth image.

    Beside Washington's `<name>_depthcrop.png`, its `<name>_maskcrop.png` and `<name>_loc.txt` are found by
    themselves.

    Parameters
    ----------
    path : str or Path
        PNG, 16 bit.
    intrinsics : Intrinsics or None
        Of the camera; by default Washington's.
    mask : str, Path or None
        PNG of the same size: 0 is not the object.
    corner : (int, int) or None, pixels
        Column and row of the first pixel in the whole picture.
    unit : float, metres
        What one step of the image's values is.

    Returns
    -------
    Scan
        In the camera's frame, the sensor at the origin.

    Raises
    ------
    ScanError
        If a file is broken, sizes differ, or too little of the object is seen.
    """
    path = Path(path)
    stem = path.name.removesuffix(".png").removesuffix("crop").removesuffix("_depth")
    beside = path.with_name(f"{stem}_maskcrop.png")
    if mask is None and path.name.endswith("_depthcrop.png") and beside.is_file():
        mask = beside
    place = path.with_name(f"{stem}_loc.txt")
    if corner is None and place.is_file():
        words = place.read_text(encoding="ascii").replace(",", " ").split()
        # The data set counts from 1, as MATLAB does.
        corner = (int(words[0]) - 1, int(words[1]) - 1)
    depth = read_image(path).astype(np.float64) * unit
    if mask is not None:
        inside = read_image(Path(mask)).astype(np.float64)
        if inside.shape != depth.shape:
            raise ScanError(f"{mask}: the mask has shape {inside.shape}, the depth image {depth.shape}")
        depth = np.where(inside > 0, depth, 0)
    points = depth_to_points(depth, intrinsics or Intrinsics(), corner or (0, 0))
    check_extent(points, str(path))
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    return Scan(points, instance=stem, sensor=np.zeros(3), source=Source(path.name, digest))
