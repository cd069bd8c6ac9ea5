"""Regenerate the table of shape concepts, their ablations and rivals on objects they were not learned from.

    python -m tests.benchmarks.bench_shapes [--out FILE] [--views 6] [--objects N] [--sphere]

Concepts are learned from `unlabelled/`, without labels. The test is a 9-nearest-neighbour classifier on views
of `objects/`, split five times by product (`dup_group`), never by view. Accuracy is the mean over the splits.
No learned embedding is among the rivals: the packages of such networks fetch their weights, none ships them.
"""

import argparse
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ersatz.acquisition.camera import CameraSettings
from ersatz.acquisition.compositions import CompositionSettings
from ersatz.acquisition.concept_learning import learn_from_segments
from ersatz.acquisition.extras import open3d
from ersatz.acquisition.layouts import FolderSettings, iter_scans
from ersatz.acquisition.repeatability import intraclass
from ersatz.acquisition.scans import Scan
from ersatz.acquisition.segments import Segments, SegmentSettings, prepare, segment
from ersatz.acquisition.shape_concepts import ConceptSettings, ShapeConcepts
from ersatz.acquisition.symbols import SymbolSettings
from ersatz.errors import InputError
from tests.conftest import DATA

COARSE: Final = {
    "ball": ("ball",),
    "bowl": ("bowl",),
    "cup": ("coffee mug", "food cup", "pitcher"),
    "can": ("food can", "soda can"),
    "bottle": ("food jar", "shampoo", "water bottle", "flashlight"),
    "box": ("cereal box", "food box", "kleenex", "sponge", "food bag"),
    "flat": ("plate", "notebook", "hand towel"),
}
"""Seven groups of the categories by their general form."""

GROUP: Final = {category: group for group, categories in COARSE.items() for category in categories}

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Views:
    """Segmented views and what they are of."""

    scans: list[Scan]
    cut: list[Segments]

    @property
    def category(self) -> NDArray[Any]:
        return np.array([scan.object_class for scan in self.scans])

    @property
    def coarse(self) -> NDArray[Any]:
        return np.array([GROUP.get(scan.object_class, "") for scan in self.scans])

    @property
    def product(self) -> NDArray[Any]:
        return np.array([scan.group for scan in self.scans])

    @property
    def instance(self) -> NDArray[Any]:
        return np.array([scan.instance for scan in self.scans])


def load(folder: Path, camera: CameraSettings, most: int | None) -> Views:
    """Return segmented views of up to `most` objects of a folder."""
    scans, cut, names = [], [], set()
    settings = SegmentSettings()
    for scan in iter_scans(folder, FolderSettings(camera, whole=False, keep_going=True)):
        names.add(scan.instance)
        if most is not None and len(names) > most:
            break
        scans.append(scan)
        cut.append(segment(prepare(scan, settings), settings))
    return Views(scans, cut)


def accuracy(
    features: Array, labels: NDArray[Any], groups: NDArray[Any], scaled: bool
) -> tuple[float, float]:
    """Return mean and deviation over five splits of the share of views that nine neighbours name right."""
    from sklearn.model_selection import StratifiedGroupKFold
    from sklearn.neighbors import KNeighborsClassifier

    found = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Some categories have fewer products than there are splits.
        splits = list(StratifiedGroupKFold(5, shuffle=True, random_state=0).split(features, labels, groups))
    for train, test in splits:
        a, b = features[train], features[test]
        if scaled:
            mean, deviation = a.mean(axis=0), a.std(axis=0) + 1e-12
            a, b = (a - mean) / deviation, (b - mean) / deviation
        model = KNeighborsClassifier(9).fit(a, labels[train])
        found.append(float((model.predict(b) == labels[test]).mean()))
    return float(np.mean(found)), float(np.std(found))


def learned(train: Views, settings: ConceptSettings) -> ShapeConcepts:
    """Return concepts learned from views."""
    names = [scan.group for scan in train.scans]
    return learn_from_segments(train.cut, names, [scan.observation for scan in train.scans], settings)


def features_of(concepts: ShapeConcepts, views: Views) -> tuple[Array, Array]:
    """Return the responses and the motifs of views."""
    composed = [concepts._compose(cut) for cut in views.cut]
    return (
        np.stack([concepts.respond(one.motifs) for one in composed]),
        np.stack([one.motifs[-1] for one in composed]),
    )


def principal(train: Array, test: Array, count: int) -> Array:
    """Return test data reduced to the first principal axes of the training data."""
    mean, deviation = train.mean(axis=0), train.std(axis=0) + 1e-12
    axes = np.linalg.svd((train - mean) / deviation, full_matrices=False)[2][:count]
    reduced: Array = ((test - mean) / deviation) @ axes.T
    return reduced


def fpfh(views: Views) -> list[Array]:
    """Return Open3D's fast point feature histograms of every view."""
    library = open3d()
    found = []
    for cut in views.cut:
        cloud = library.geometry.PointCloud(library.utility.Vector3dVector(cut.surface.points))
        cloud.normals = library.utility.Vector3dVector(cut.surface.normals)
        search = library.geometry.KDTreeSearchParamHybrid(radius=5 * cut.surface.spacing, max_nn=100)
        found.append(np.asarray(library.pipelines.registration.compute_fpfh_feature(cloud, search).data).T)
    return found


def bag_of_words(train: list[Array], test: list[Array], words: int) -> tuple[Array, Array]:
    """Return histograms of visual words learned by k-means on the training points."""
    from sklearn.cluster import MiniBatchKMeans

    points = np.concatenate([one[:: max(len(one) // 100, 1)] for one in train])
    model = MiniBatchKMeans(words, n_init=3, random_state=0).fit(points)

    def histogram(one: Array) -> Array:
        return np.sqrt(np.bincount(model.predict(one), minlength=words) / len(one))

    return np.stack([histogram(one) for one in train]), np.stack([histogram(one) for one in test])


def ensemble(views: Views) -> Array:
    """Return a global histogram in the manner of ESF: distances, areas and angles of random points."""
    found = []
    for cut in views.cut:
        rng = np.random.default_rng(0)
        a, b, c = cut.surface.points[rng.integers(0, len(cut.surface.points), (3, 5000))]
        sides = [np.linalg.norm(x - y, axis=1) / cut.surface.diagonal for x, y in ((a, b), (b, c), (c, a))]
        area = np.sqrt(np.linalg.norm(np.cross(b - a, c - a), axis=1)) / cut.surface.diagonal
        cosine = np.clip(
            ((b - a) * (c - a)).sum(axis=1) / (sides[0] * sides[2] * cut.surface.diagonal**2 + 1e-12), -1, 1
        )
        parts = [
            np.histogram(v, 32, r)[0] for v, r in ((sides[0], (0, 1)), (area, (0, 0.8)), (cosine, (-1, 1)))
        ]
        found.append(np.sqrt(np.concatenate(parts) / 5000))
    return np.stack(found)


def extents(views: Views) -> Array:
    """Return the logarithms of the box sizes along the principal axes, metres."""
    sizes: Array = np.log(np.stack([np.ptp(cut.surface.points, axis=0) for cut in views.cut]))
    return sizes


def variants(
    train: Views, test: Views, half: Views, rest: Views
) -> Iterator[tuple[str, Views, Array, bool, bool]]:
    """Yield (name, views, features, whether to scale them, whether they are responses)."""
    base = ConceptSettings()
    concepts = learned(train, base)
    responses, motifs = features_of(concepts, test)
    yield "**4 responses (default)**", test, responses, True, True
    yield "full motif vector", test, motifs, False, False
    before = replace(base, patterns=1, relative=False)
    groups = replace(base.compositions, smallest=0.5)
    changed: dict[str, ConceptSettings] = {
        "k-means instead of persistence": replace(base, persistence=False),
        "the most prominent patterns, not the most repeatable": replace(base, patterns=1),
        "8 patterns instead of 16 to choose from": replace(base, patterns=2),
        "responses on one scale for all views": replace(base, relative=False),
        "both: prominent, on one scale": before,
        "both, k-means": replace(before, persistence=False),
        "groups of half the object compared, too": replace(base, compositions=groups),
        "all three": replace(before, compositions=groups),
        "one dictionary level (16)": replace(base, symbols=SymbolSettings((16,))),
        "no form of the whole (symbols only)": replace(
            base, compositions=CompositionSettings(form_weight=0.0)
        ),
    }
    changed |= {
        f"{n} concepts": replace(base, patterns=max(4, 16 // n), concepts=n) for n in (2, 3, 6, 8, 12, 16)
    }
    for name, settings in changed.items():
        try:
            found, vector = features_of(learned(train, settings), test)
        except InputError as error:
            print(f"{name}: {error}", file=sys.stderr)
            continue
        yield name, test, found, True, True
        if "symbols only" in name:
            yield "full motif vector, symbols only", test, vector, False, False
    other = learned(half, replace(base, patterns=2, persistence=False))
    yield (
        "learned from half the objects (other half tested), k-means",
        rest,
        features_of(other, rest)[0],
        True,
        True,
    )
    words = bag_of_words(fpfh(train), fpfh(test), 64)
    yield "rival: FPFH bag of 64 words, 4 principal axes", test, principal(*words, 4), True, False
    yield "rival: FPFH bag of 64 words, full", test, words[1], False, False
    yield "rival: 4 FPFH words", test, bag_of_words(fpfh(train), fpfh(test), 4)[1], True, False
    yield "rival: box sizes (3 numbers, metric)", test, extents(test), True, False
    both = ensemble(train), ensemble(test)
    yield "rival: ESF-like histogram, 4 principal axes", test, principal(*both, 4), True, False
    yield "rival: ESF-like histogram, full", test, both[1], False, False


def part(views: Views, chosen: Callable[[Scan], bool]) -> Views:
    """Return some of the views."""
    index = [i for i, scan in enumerate(views.scans) if chosen(scan)]
    return Views([views.scans[i] for i in index], [views.cut[i] for i in index])


def report(views: int, most: int | None, upper: bool) -> Iterator[str]:
    """Yield the lines of the report."""
    # As `unlabelled_scans` has them: nobody knows how those objects stand.
    train = load(DATA / "unlabelled", CameraSettings(views=4 * views, upper=False), most)
    test = load(DATA / "objects", CameraSettings(views=views, upper=upper), most)
    products = np.unique(test.product)
    first = set(np.random.default_rng(0).permutation(products)[: len(products) // 2].tolist())
    half, rest = part(test, lambda s: s.group in first), part(test, lambda s: s.group not in first)
    majority = np.unique(test.coarse, return_counts=True)[1].max() / len(test.scans)
    where = "20-70 degrees above the xy-plane" if upper else "the whole viewing sphere"
    objects, others = len(np.unique(test.instance)), len(np.unique(train.instance))
    yield f"{objects} objects, {len(products)} products, {len(test.scans)} views from {where};"
    yield f"concepts from {len(train.scans)} views of {others} other objects; majority {majority:.2f}"
    yield ""
    yield "| features | coarse (7) | categories | ICC |"
    yield "|---|---|---|---|"
    for name, some, features, scaled, responds in variants(train, test, half, rest):
        coarse, spread = accuracy(features, some.coarse, some.product, scaled)
        fine, _ = accuracy(features, some.category, some.product, scaled)
        repeat = " ".join(f"{v:.2f}" for v in intraclass(features, some.instance)) if responds else ""
        yield f"| {name} | {coarse:.2f} ± {spread:.2f} | {fine:.2f} | {repeat} |"
    yield ""
    yield timing(train, test)


def timing(train: Views, test: Views) -> str:
    """Return how long a view takes from cloud to responses."""
    concepts = learned(train, ConceptSettings())
    some = test.scans[:: max(len(test.scans) // 100, 1)]
    start = time.process_time()
    for scan in some:
        concepts.responses(scan)
    spent = (time.process_time() - start) / len(some) * 1000
    raw = float(np.mean([len(scan.points) for scan in some]))
    return f"{spent:.0f} ms of processor time a view of {raw:.0f} points on average, from cloud to responses"


def main(words: list[str] | None = None) -> None:
    """Print the report, or write it to a file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--views", type=int, default=6)
    parser.add_argument("--objects", type=int, help="only the first so many, for a trial")
    parser.add_argument("--sphere", action="store_true", help="from all sides, also from below")
    given = parser.parse_args(words)
    with given.out.open("w", encoding="utf-8") if given.out else sys.stdout as file:
        for line in report(given.views, given.objects, not given.sphere):
            print(line, file=file, flush=True)


if __name__ == "__main__":
    main()
