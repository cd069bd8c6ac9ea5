"""Rivals by distance of raw features: the nearest class in numbers, without qualities or functions."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ersatz.evaluation.agreement import Answer
from ersatz.evaluation.features import ClassFeatures, class_features, standardized
from ersatz.evaluation.methods import Context
from ersatz.evaluation.scenarios import Scenario


@dataclass(frozen=True, slots=True, eq=False)
class Nearest:
    """The class nearest to the missing tool's.

    Attributes
    ----------
    features : ClassFeatures
    points : (c, k) float64 array
        Where each class lies.
    """

    features: ClassFeatures
    points: NDArray[np.float64]

    def answer(self, scenario: Scenario) -> Answer:
        """Score by the Euclidean distance, negated."""
        rows = [self.features.row[name] for name in scenario.available]
        away = self.points[rows] - self.points[self.features.row[scenario.missing]]
        return Answer(tuple(-round(float(d), 9) for d in np.sqrt((away**2).sum(axis=1))))


def feature_distance(context: Context) -> Nearest:
    """Return the nearest class by z-scored means of all physical properties."""
    features = context.kb.view(class_features)
    return Nearest(features, standardized(features.of()))


def box_size(context: Context) -> Nearest:
    """Return the nearest class by the logarithms of the bounding box's edges."""
    features = context.kb.view(class_features)
    return Nearest(features, standardized(np.log(np.maximum(features.of(["size"]), 1e-4))))


def shape_concepts(context: Context) -> Nearest:
    """Return the nearest class by its responses to the learned shape concepts (after Mueller & Birk 2018).

    Takes the responses that the knowledge base holds; does not compare compositions of segments.
    """
    features = context.kb.view(class_features)
    names = sorted({name for name, _ in features.columns if name.startswith("shape_")})
    return Nearest(features, standardized(features.of(names or ["shape_1"])))


def parts_and_mass(context: Context) -> Nearest:
    """Return the nearest class by proportions and mass, after Abelha, Guerin & Schoeler 2016.

    Takes from "A model-based approach to finding substitute tools in 3D vision data": that a tool is
    described by the proportions of its parts' fitted shapes and by its mass, and a substitute by how near
    it comes. Does not take: the segmentation into grasping and action parts, the superquadrics fitted to
    them (here the box and hollowness of the whole stand for them), nor the functions of fitness tuned for
    each task; it knows no task.
    """
    features = context.kb.view(class_features)
    size = np.log(np.maximum(features.of(["size"]), 1e-4))
    mass = np.log(np.maximum(features.of(["weight"]), 1e-4))
    parts = [size[:, :1] - size[:, 1:2], size[:, 1:2] - size[:, 2:3], size[:, :1], mass]
    return Nearest(features, standardized(np.hstack([*parts, features.of(["hollowness"])])))
