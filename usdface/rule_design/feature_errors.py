"""Errors of marker features on another person: other skin, markers beside their places, noise."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from usdface.arrays import FloatArray, IntArray
from usdface.blend_shapes.vertex_evaluator import evaluator_of
from usdface.face.bound_face import BoundFace
from usdface.face.surface_graph import surface_graph
from usdface.geometry.marker_spread import marker_spread

__all__ = ["FeatureErrors", "feature_errors", "misplacement"]

# Tuned by hand against benchmarks/expressions.py and benchmarks/expression_takes.py, which judge
# them, unless noted otherwise; see docs/constants.md.
# Error of a feature on another person's face [m]: residual of the solve for a bend of the space
# map.
_FACE_ERROR = 0.0005
# Other people's skin moves in other directions: error of a feature by its marker's motion.
_DIRECTION_ERROR = 0.3
# How far markers sit beside their vertices, as a share of their spread: 1.8 mm on the ICT face.
# Twice as far, single shapes of the example are an emotion.
_MISPLACED = 0.03
# Vertices around a marker: at least, for coarse meshes, and at most, about, for dense ones.
_AROUND, _MOST = 6, 64


@dataclass(frozen=True, eq=False, slots=True)
class FeatureErrors:
    """Errors of the features of one expression.

    Attributes
    ----------
    noise : (I,) float64 [m]
        Standard deviation after the solve.
    total : (I,) float64 [m]
        With other skin, and markers beside their places.
    """

    noise: FloatArray
    total: FloatArray


def feature_errors(own: FloatArray, noise: FloatArray, misplaced: FloatArray) -> FeatureErrors:
    """Return the errors of features at an expression's pose.

    Parameters
    ----------
    own : (I,) float64 [m]
        The features there, three for each marker.
    noise, misplaced : (I,) float64 [m]
        Standard deviation after the solve; `misplacement` at the pose.
    """
    travel = np.repeat(np.linalg.norm(own.reshape(-1, 3), axis=1), 3)
    squares = noise**2 + misplaced**2 + _FACE_ERROR**2 + (_DIRECTION_ERROR * travel) ** 2
    return FeatureErrors(noise, np.asarray(np.sqrt(squares)))


def misplacement(face: BoundFace, poses: FloatArray) -> FloatArray:
    """Return the error of markers that sit beside their vertices: (E, 3 B) [m].

    RMS of the difference from the vertices around, those of the other lip or lid, too; from those
    further away than a marker usually sits, in proportion.

    Parameters
    ----------
    face : BoundFace
    poses : (E, S) float64
    """
    away = _MISPLACED * marker_spread(face.neutral)
    around = _vertices_around(face, away)
    used = np.unique(np.concatenate(around))
    evaluator, _ = evaluator_of(face.mesh.shapes, used)
    moved = evaluator.displacements(evaluator.combined(poses)).reshape(len(poses), len(used), 3)
    own = face.displacements(poses)
    errors = np.zeros(own.shape)
    for marker, near in enumerate(around):
        distance = np.linalg.norm(face.mesh.points[near] - face.neutral[marker], axis=1)
        share = away / np.maximum(distance, away)
        unlike = share[:, None] * (moved[:, np.searchsorted(used, near)] - own[:, marker, None])
        errors[:, marker] = np.sqrt((unlike**2).mean(axis=1))
    return errors.reshape(len(poses), 3 * len(around))


def _vertices_around(face: BoundFace, away: float) -> list[IntArray]:
    """Return the vertices within `away` [m] of each marker, at least the nearest ones.

    Itself is among them; all are of the skin that it is on: no eyeballs, no teeth.
    """
    _, part = connected_components(surface_graph(face.mesh), directed=False)
    skin = np.flatnonzero(np.isin(part, part[face.vertices]))
    tree = cKDTree(face.mesh.points[skin])
    count = range(1, min(_AROUND + 1, len(skin)) + 1)
    nearest = tree.query(face.neutral, k=count)[1]
    within = tree.query_ball_point(face.neutral, away)
    around = []
    for vertex, near, few in zip(face.vertices, within, nearest, strict=True):
        close = skin[np.union1d(near[:: len(near) // _MOST + 1], few).astype(np.int64)]
        around.append(close[part[close] == part[vertex]])
    return around
