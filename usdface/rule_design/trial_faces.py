"""Trial faces: positive and negative examples for a rule of an expression, with their costs."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.numerics.cosines import cosines
from usdface.rule_design.face_motions import FaceMotions

__all__ = ["TrialFaces", "trial_faces"]

# Tuned by hand against benchmarks/expressions.py and benchmarks/expression_takes.py, which judge
# them, unless noted otherwise; see docs/constants.md.
# Similarity to the pose (cosine; both halves of the face count equally) from which a movement
# is the expression, or a part of it, and up to which it is a rival.
_SAME, _PART, _RIVAL = 0.85, 0.8, 0.6
# Costs of not firing: at the pose, at a movement that is the expression, at the pose without a
# part, and at all poses with one more movement at half.
_POSE, _LIKE, _WITHOUT, _WITH = 6.0, 3.0, 2.0, 4.0
# Costs of firing: at another pose, at half and whole; and, all together, at other poses with one
# more movement, at movements alone, and at several.
_OTHER_POSE, _VARIED, _ALONE, _MIXED = 250.0, 40.0, 60.0, 120.0
_MORE, _HALF = 0.6, 0.5
# Least motion of a half of the face that counts in the similarity [m]: noise is no expression.
_STILL = 0.0015


@dataclass(frozen=True, eq=False, slots=True)
class TrialFaces:
    """Features (P, I) of faces that a rule is to fire on, and not to, with the costs (P,)."""

    wanted: FloatArray
    wanted_costs: FloatArray
    rivals: FloatArray
    rival_costs: FloatArray


def trial_faces(index: int, motions: FaceMotions) -> TrialFaces:
    """Return the faces that a rule of the expression in row `index` of the poses is tried on."""
    moves, pose, upper = motions.movements, motions.poses[index], motions.upper
    own = motions.features(pose[None])[0]
    others = np.delete(motions.poses, index, axis=0)

    def unlike(weights: FloatArray, most: float) -> FloatArray:
        return weights[_similarity(motions.features(weights), own, upper) < most]

    def like(weights: FloatArray, least: float) -> FloatArray:
        weights = weights[weights.any(axis=1)]
        return weights[_similarity(motions.features(weights), own, upper) > least]

    without = np.unique(np.where(moves.whole > 0, 0.0, pose), axis=0)
    varied = np.clip(others[:, None] + _MORE * moves.whole, 0.0, 1.0).reshape(-1, len(pose))
    mostly = unlike(np.concatenate([moves.single, _HALF * moves.single]), _PART)
    wanted = [
        (pose[None], _POSE),
        (like(moves.whole * pose.max(initial=0.0), _SAME), _LIKE),
        (like(without[(without < pose).any(axis=1)], _PART), _WITHOUT),
        (like(np.clip(pose + _HALF * moves.whole, 0.0, 1.0), _PART), -_WITH),
    ]
    rivals = [
        (np.concatenate([others, _HALF * others]), _OTHER_POSE),
        (unlike(varied, _RIVAL + 0.1), -_VARIED),
        (mostly, -_ALONE),
        (unlike(moves.mixed, _RIVAL), -_MIXED),
    ]
    return TrialFaces(
        motions.features(np.concatenate([rows for rows, _ in wanted])),
        _costs(wanted),
        motions.features(np.concatenate([rows for rows, _ in rivals])),
        _costs(rivals),
    )


def _costs(parts: Sequence[tuple[FloatArray, float]]) -> FloatArray:
    """Return the cost of each row; a negative one is shared by all rows of its part."""
    return np.concatenate(
        [np.full(len(rows), c if c > 0 else -c / max(len(rows), 1)) for rows, c in parts]
    )


def _similarity(moved: FloatArray, own: FloatArray, upper: BoolArray) -> FloatArray:
    """Return the cosine between faces (P, I) and the expression (I,): (P,).

    Each half of the face is divided by the largest motion of the expression in it, so that a jaw
    does not outweigh the brows.
    """
    scale = np.ones(len(own))
    for half in (upper, ~upper):
        largest = float(np.abs(own[half]).max(initial=0.0))
        scale[half] = np.sqrt(max(half.sum(), 1)) * max(largest, _STILL)
    return cosines(moved / scale, own / scale)
