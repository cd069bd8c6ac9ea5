"""Parametric scans for tests: small, seeded, of known form."""

from collections.abc import Iterator

import numpy as np

from ersatz.acquisition.camera import CameraSettings
from ersatz.acquisition.layouts import FolderSettings, views_of
from ersatz.acquisition.meshes import Mesh
from ersatz.acquisition.parametric import box, cylinder, sphere, tumbler
from ersatz.acquisition.scans import Scan
from ersatz.measurements import Origin


def mesh_of(kind: str, number: int) -> Mesh:
    """Return a box, can, ball or cup; `number` varies its proportions."""
    rng = np.random.default_rng([number, ord(kind[0]), ord(kind[1])])
    a, b, c = sorted(rng.uniform(0.05, 0.2, 3))
    if kind == "box":
        return box(c, b, a)
    if kind == "can":
        return cylinder(a, c)
    if kind == "ball":
        return sphere(b)
    return tumbler(a, 1.2 * a, b, 0.003).mesh


def whole(kind: str, number: int) -> Scan:
    mesh = mesh_of(kind, number)
    return Scan(mesh.vertices, kind, f"{kind}_{number}", mesh=mesh, mass=0.2, origin=Origin.SYNTHETIC)


def views(kinds: tuple[str, ...], numbers: range, count: int = 3) -> Iterator[Scan]:
    """Yield views of objects of all kinds."""
    settings = FolderSettings(CameraSettings(views=count), whole=False)
    for number in numbers:
        for kind in kinds:
            yield from views_of(whole(kind, number), settings, number)
