"""Facts the shipped benchmark rests on: measured from scans, weighed, voted, labelled; one source a fact.

Everything here is computed by rules from other people's data, which stays where it is. It shares no code
with the geometry of `acquisition/`, so that an error there cannot pass for agreement.
"""

import ast
import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ersatz.errors import InputError

TRUSTED: Final = 1.0
"""Least trust of an affordance label; the labels below were derived by machine and are often wrong."""

CLOSED: Final = frozenset(
    (
        "cereal box",
        "food bag",
        "food box",
        "food can",
        "food jar",
        "kleenex",
        "shampoo",
        "soda can",
        "water bottle",
    )
)
"""Scanned closed: their surface does not tell what their inside would hold."""

SOLID: Final = frozenset(("kit_CondensedMilk", "kit_ChocoIcing", "kit_Margarine", "ycb_019_pitcher_base"))
"""Scans of open things that came out without their interior."""


@dataclass(frozen=True, slots=True)
class Facts:
    """What is known of one category; None or empty is "the sources do not tell".

    Attributes
    ----------
    extents : (length, width, height) in metres, or None
        Medians over objects of the edges of the smallest box, longest first.
    roundness : float or None, in [0, 1]
        Median ratio of the two shorter edges: 1 for what is round about its long axis.
    fullness : float or None, in [0, 1]
        Median volume of the convex hull over that of the box: box 1, upright cylinder 0.79, ball 0.52.
    cavity : float or None, litres
        Median volume that would stay in the object in its best position.
    mass : float or None, kg
        Median of weighed objects; else the mean of at least ten entries of shops (Hullman et al. 2018).
    rigid : float or None, in [0, 1]
        Share of people who call it rigid (Hullman et al. 2018).
    softness : int or None
        NEWTON's label from 1 (hard) to 3 (soft), if all things of the category have the same.
    affordances : frozenset of str
        RoboCSK's labels with trust of at least `TRUSTED`.
    """

    extents: tuple[float, float, float] | None
    roundness: float | None
    fullness: float | None
    cavity: float | None
    mass: float | None
    rigid: float | None
    softness: int | None
    affordances: frozenset[str]

    @property
    def hard(self) -> bool | None:
        """Whether it keeps its shape: by votes, else by label; None between, or if they differ."""
        if (
            self.rigid is not None
            and self.softness is not None
            and (self.rigid >= 0.5) != (self.softness == 1)
        ):
            return None
        if self.rigid is not None:
            return True if self.rigid >= 0.7 else False if self.rigid <= 0.3 else None
        return None if self.softness in (None, 2) else self.softness == 1


def read_facts(data: Path) -> dict[str, Facts]:
    """Read manifest, scans, evidence and affordances; return the facts of each category.

    Raises
    ------
    InputError
        If a file is not there.
    """
    manifest = _rows(data / "objects" / "manifest.csv")
    evidence = _rows(data / "category_property_evidence.csv")
    labels = {
        row["Object"]: row["Affordances"] for row in _rows(data / "affordances" / "affordance_data.csv")
    }
    return {
        row["category"]: _facts(
            row, [one for one in manifest if one["category"] == row["category"]], labels, data / "objects"
        )
        for row in sorted(evidence, key=lambda row: row["category"])
    }


def _facts(
    evidence: Mapping[str, str], objects: Sequence[Mapping[str, str]], labels: Mapping[str, str], folder: Path
) -> Facts:
    name = evidence["category"]
    exact = [one for one in objects if one["fit"] == "exact"] or list(objects)
    products = list({one["dup_group"]: one for one in exact}.values())
    boxes = [tuple(sorted((float(one[f"obb_{axis}_m"]) for axis in "lwh"), reverse=True)) for one in products]
    weighed = [float(one["mass_kg"]) for one in products if one["mass_kg"]]
    weighed = weighed or [float(one["mass_kg"]) for one in objects if one["mass_kg"]]
    rigid, weights = _votes(evidence["hullman_rigid_votes"]), _weights(evidence["hullman_weight_kg"])
    soft = {label.split("=")[1][0] for label in evidence["newton_Softness"].split(";") if label}
    stated = ast.literal_eval(labels.get(name, "{}"))
    clouds = {one["id"]: read_points(folder / one["file"]) for one in products}
    hollow = [one["id"] for one in products if one["id"] not in SOLID and name not in CLOSED]
    cavities = [_cavity(clouds[identifier]) for identifier in hollow]
    extents = tuple(median(box[at] for box in boxes) for at in range(3)) if boxes else None
    return Facts(
        None if extents is None else (extents[0], extents[1], extents[2]),
        median(box[2] / box[1] for box in boxes) if boxes else None,
        median(map(_fullness, clouds.values(), boxes)) if boxes else None,
        median(cavities) if cavities else None,
        median(weighed) if weighed else weights,
        rigid,
        int(soft.pop()) if len(soft) == 1 else None,
        frozenset(word for word, trust in stated.values() if trust >= TRUSTED),
    )


def read_points(path: Path) -> NDArray[np.float64]:
    """Return the points of a cloud (.npz) or dense samples of a mesh's faces (binary .ply), in metres."""
    if path.suffix == ".npz":
        with np.load(path) as archive:
            return np.asarray(archive["points"], dtype=np.float64)
    raw = path.read_bytes()
    head, _, body = raw.partition(b"end_header\n")
    lines = head.decode("ascii").splitlines()
    if "format binary_little_endian 1.0" not in lines:
        raise InputError(f"{path.name} is not a binary PLY")
    n, m = (
        int(next(x for x in lines if x.startswith(f"element {e} ")).split()[2]) for e in ("vertex", "face")
    )
    before_faces = lines[: next(at for at, x in enumerate(lines) if x.startswith("element face"))]
    width = sum(1 for x in before_faces if x.startswith("property float"))
    corners = np.frombuffer(body, "<f4", n * width).reshape(n, width)[:, :3].astype(np.float64)
    faces = np.frombuffer(body, np.dtype([("k", "u1"), ("v", "<i4", 3)]), m, n * width * 4)["v"]
    return _sampled(corners, faces)


def _sampled(
    corners: NDArray[np.float64], faces: NDArray[np.int32], count: int = 60_000
) -> NDArray[np.float64]:
    """Return corners and about `count` points spread over the faces by area; the same every time."""
    a, b, c = (corners[faces[:, at]] for at in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    chance = np.random.default_rng(0)
    picked = chance.choice(len(faces), count, p=area / area.sum())
    u, v = chance.random((2, count, 1))
    over = u + v > 1
    u, v = np.where(over, 1 - u, u), np.where(over, 1 - v, v)
    return np.vstack([corners, a[picked] + u * (b - a)[picked] + v * (c - a)[picked]])


def _fullness(points: NDArray[np.float64], box: Sequence[float]) -> float:
    from scipy.spatial import ConvexHull

    return min(1.0, float(ConvexHull(points).volume) / float(np.prod(box)))


def _cavity(points: NDArray[np.float64], cells: int = 32) -> float:
    """Return litres held in the best of the six positions on the axes of the body (by principal axes).

    The surface seen from above is a map of heights; water stands in each cell up to the lowest pass to
    the rim.
    """
    middle = points - points.mean(axis=0)
    axes = np.linalg.svd(middle, full_matrices=False)[2]
    body = middle @ axes.T
    best = 0.0
    for up in range(3):
        plane = np.delete(body, up, axis=1)
        low = plane.min(axis=0)
        edge = float(np.ptp(plane, axis=0).max()) / cells
        at = np.minimum(((plane - low) / edge).astype(int), cells - 1) + 1
        for sign in (1, -1):
            height = np.full((cells + 2, cells + 2), -np.inf)
            np.maximum.at(height, (at[:, 0], at[:, 1]), sign * body[:, up])
            best = max(best, _standing(height) * edge * edge * 1000)
    return best


def _standing(height: NDArray[np.float64]) -> float:
    """Return the sum of water depths in a map of heights whose outside is open (-inf)."""
    level = np.where(np.isinf(height), -np.inf, np.inf)
    while True:
        padded = np.pad(level, 1, constant_values=-np.inf)
        lowest = np.minimum.reduce([padded[:-2, 1:-1], padded[2:, 1:-1], padded[1:-1, :-2], padded[1:-1, 2:]])
        lower = np.maximum(height, np.minimum(level, lowest))
        if np.array_equal(lower, level):
            break
        level = lower
    known = np.isfinite(height)
    return float((level[known] - height[known]).sum())


def _votes(cell: str) -> float | None:
    pairs = [part.split("=")[1].split("/") for part in cell.split(";") if part]
    return sum(int(yes) for yes, _ in pairs) / sum(int(of) for _, of in pairs) if pairs else None


def _weights(cell: str) -> float | None:
    """Return the mean over the things with at least ten shop entries, if there are any."""
    found = [part.partition("=")[2].rstrip(")").split("(n=") for part in cell.split(";") if part]
    enough = [(float(mean), int(n)) for mean, n in found if int(n) >= 10]
    return sum(mean * n for mean, n in enough) / sum(n for _, n in enough) if enough else None


def _rows(path: Path) -> list[dict[str, str]]:
    try:
        with path.open(encoding="utf-8", newline="") as file:
            return list(csv.DictReader(file))
    except OSError as error:
        raise InputError(f"the benchmark's sources are not here: {error}") from None
