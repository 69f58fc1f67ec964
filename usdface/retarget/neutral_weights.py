"""Blend shape weights of the neutral frames of a performer.

A performer's neutral may have weights above 0, such as half closed lids or pressed lips.
Displacements are relative to it, so where a weight falls below its neutral value they need a
negative one. The neutral weights are those with which every frame is explained by weights of 0 or
more. Weights that no frame needs stay 0, and all do where they hardly help to explain the take.
"""

from collections.abc import Mapping

import numpy as np

from usdface.arrays import FloatArray
from usdface.face.bound_face import BoundFace
from usdface.geometry.marker_spread import rms_radius
from usdface.geometry.rigid_fit import rigid_fit, similarity_fit
from usdface.geometry.rigid_modes import motion_basis
from usdface.retarget.solver.bounded_least_squares import solve_bounded
from usdface.takes import visible

__all__ = ["LARGEST", "estimate_neutral_weights", "weights_at_limit", "without_weights"]

# As shares of the face's size, the RMS radius of its markers (ICT: 60 mm): a marker's error in any
# frame, its error in the mean of all, and the motion beyond which a frame has less weight, because
# performer and rig differ more in strong expressions. Set by hand: 1 mm, 0.2 mm and 2 mm on that
# face, where a real take of another face has a misfit of 0.9 mm (AnimFace).
_ERROR = 0.016
_LASTING_ERROR = 0.0032
_STRONG = 0.032
# Expected size of weights (`SolveOptions.spread`), L1 penalty, and expected size of the neutral
# weights. Set by hand.
_SPREAD = 0.5
_SPARSITY = 0.5
_REST_SPREAD = 0.15
LARGEST = 0.5  # more than half of a shape is no neutral
# Bounds on time: sampled frames, and steps of the search.
_FRAMES = 200
_STEPS = 60
# Weights are saved to three decimals.
_ROUNDING = 6e-4
# A marker must be seen in so many of the frames, and so many frames show all those markers; eight
# markers have 18 coordinates beside the head's six.
_SEEN = 0.9
_FEWEST_FRAMES = 10
_FEWEST_MARKERS = 8
# Performers with another face than the rig's seem to have neutral weights up to 0.15 where the true
# ones are 0: if none is larger all are set to 0. Otherwise small ones are left out. Set by hand;
# python benchmarks/binding.py rests measures them.
_NEUTRAL = 0.16
_LEAST = 0.02
# Performers whose shapes move in other directions seem to have larger ones, but these hardly help
# to explain the take: the cost without them is 1.05 to 1.25 of that with them, on twelve takes of
# other people with a true neutral; 1.19 to 5.4 where the neutral has weights (python
# benchmarks/binding.py rests). Below this factor all are set to 0.
_SURE = 1.3


def estimate_neutral_weights(
    positions: FloatArray, neutral: FloatArray, points: FloatArray, offsets: FloatArray
) -> FloatArray:
    """Estimate the weights of the face in the neutral frames: (S,) in [0, 0.5].

    A convex problem: the bounded weights of the neutral and of each frame that explain the
    displacements from neutral, with an L1 penalty. All 0 where too few markers are visible, or none
    is clearly above the effect of the difference of two faces.

    Parameters
    ----------
    positions : (F, M, 3) float64
        The take, NaN where occluded.
    neutral : (M, 3) float64
        The neutral in one head pose, NaN where a marker is occluded.
    points : (M, 3) float64 [m]
        The markers' places on the neutral character.
    offsets : (S, M, 3) float64 [m]
        Their offset by each blend shape at weight 1.
    """
    from scipy.optimize import minimize  # costs more to import than a solve needs

    count = len(offsets)
    shared = _in_errors(positions, neutral, points, offsets)
    if shared is None:
        return np.zeros(count)
    moved, shapes = shared
    normal = shapes @ shapes.T
    right = moved @ shapes.T - _SPARSITY / _SPREAD
    frame_weight = 1.0 / (1.0 + (moved**2).mean(axis=1) * (_ERROR / _STRONG) ** 2)
    frame_weight /= frame_weight.sum()
    ridge = (_LASTING_ERROR / _ERROR / _REST_SPREAD) ** 2

    def cost(rest: FloatArray) -> tuple[float, FloatArray]:
        weights = solve_bounded(normal + np.eye(count) / _SPREAD**2, right + rest @ normal)
        left = moved + (rest - weights) @ shapes
        each = 0.5 * (left**2).sum(axis=1) + 0.5 * (weights**2).sum(axis=1) / _SPREAD**2
        each += _SPARSITY / _SPREAD * weights.sum(axis=1)
        value = float(frame_weight @ each + 0.5 * ridge * (rest**2).sum())
        return value, frame_weight @ (left @ shapes.T) + ridge * rest

    result = minimize(
        cost,
        np.zeros(count),
        jac=True,
        method="L-BFGS-B",
        bounds=[(0.0, LARGEST)] * count,
        options={"maxiter": _STEPS},
    )
    found = result.x
    if found.max() < _NEUTRAL or cost(np.zeros(count))[0] < _SURE * result.fun:
        return np.zeros(count)
    return np.where(found < _LEAST, 0.0, found)


def _in_errors(
    positions: FloatArray, neutral: FloatArray, points: FloatArray, offsets: FloatArray
) -> tuple[FloatArray, FloatArray] | None:
    """Return displacements (F, 3 M) and offsets (S, 3 M) in units of the error of a marker.

    On the character, of some frames and the markers that these and the rest show, without the
    head's motion; None where they are too few.
    """
    seen = visible(positions)
    used = (seen.mean(axis=0) >= _SEEN) & visible(neutral)
    whole = np.flatnonzero(seen[:, used].all(axis=1))
    if used.sum() < _FEWEST_MARKERS or len(whole) < _FEWEST_FRAMES:
        return None
    frames = positions[whole[:: max(1, len(whole) // _FRAMES)]][:, used]
    rest, target = neutral[used], points[used]
    size = rms_radius(target)
    pose, _ = rigid_fit(rest, frames)
    moved = (pose.to_head(frames) - rest) @ similarity_fit(rest, target)[0]
    rigid = motion_basis(target, 3)
    flat = np.concatenate(
        [moved.reshape(len(moved), -1), offsets[:, used].reshape(len(offsets), -1)]
    )
    flat = (flat - (flat @ rigid) @ rigid.T) / (_ERROR * size)
    return flat[: len(moved)], flat[len(moved) :]


def weights_at_limit(weights: Mapping[str, float], face: BoundFace) -> tuple[str, ...]:
    """Return the shapes whose neutral weight is `LARGEST`, or is as far along its inbetweens.

    More of them may show. Larger weights are none of an estimate.
    """
    linear = np.full((1, len(face.shape_names)), LARGEST)
    limits = dict(zip(face.shape_names, face.evaluator.from_linear(linear)[0], strict=True))
    return tuple(n for n, weight in weights.items() if abs(weight - limits[n]) < _ROUNDING)


def without_weights(neutral: FloatArray, points: FloatArray, shown: FloatArray) -> FloatArray:
    """Return the performer's neutral (M, 3) without the displacements of its neutral weights.

    `neutral` and `points` are as in `estimate_neutral_weights`, without NaN; `shown` (M, 3) [m] is
    the displacement on the character.
    """
    linear, _ = similarity_fit(neutral, points)
    return np.asarray(neutral - shown @ np.linalg.inv(linear))
