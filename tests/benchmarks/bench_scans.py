"""Time a partial view of about 2,000 points from cloud in memory to responses, on one core.

Part of `python -m tests.benchmarks`. The views are of our own parametric models, so that anyone can run it;
`tests.benchmarks.bench_shapes` prints the same time over real scans.
"""

import time
from typing import Final

import numpy as np

from ersatz.acquisition.camera import CameraSettings, VirtualCamera
from ersatz.acquisition.extras import open3d
from ersatz.acquisition.parametric import MODELS, model
from ersatz.acquisition.scans import Scan
from ersatz.acquisition.shape_concepts import ShapeConcepts
from ersatz.resources import ONTOLOGY
from tests.benchmarks.measuring import Rival, Row, race

POINTS: Final = 2_000
LIMIT: Final = 0.040
"""Seconds a view may take."""


def run(quick: bool) -> list[Row]:
    """Time the shipped concepts on views of every model, beside Open3D's features of the same points."""
    concepts = ShapeConcepts.load(ONTOLOGY / "household.concepts.npz")
    views = seen(1 if quick else 5)
    library = open3d()

    def respond() -> list[object]:
        return [concepts.responses(view) for view in views]

    def features() -> list[object]:
        return [fpfh(view) for view in views]

    def fpfh(view: Scan) -> object:
        cloud = library.geometry.PointCloud(library.utility.Vector3dVector(view.points))
        spacing = float(np.mean(cloud.compute_nearest_neighbor_distance()))
        near = library.geometry.KDTreeSearchParamHybrid(radius=2 * spacing, max_nn=30)
        cloud.estimate_normals(near)
        wide = library.geometry.KDTreeSearchParamHybrid(radius=5 * spacing, max_nn=100)
        return library.pipelines.registration.compute_fpfh_feature(cloud, wide)

    return race(
        "view to concept responses",
        f"{POINTS:,} points",
        respond,
        [Rival("Open3D: normals and FPFH, no concepts yet", features, package="open3d")],
        rounds=2 if quick else 7,
        clock=time.process_time,
        limit=LIMIT,
        pieces=len(views),
    )


def seen(number: int) -> list[Scan]:
    """Return views of so many models of each category, of `POINTS` points each."""
    views = []
    for category in sorted(MODELS):
        for at in range(1, number + 1):
            camera = VirtualCamera(model(category, at), CameraSettings(views=1))
            points, eye = next(camera.views(at))
            chosen = np.random.default_rng(at).permutation(len(points))[:POINTS]
            views.append(Scan(points[np.sort(chosen)], category, f"{category} {at}", sensor=eye))
    return views
