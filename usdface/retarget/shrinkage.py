"""Shrinkage of the brows by the solve, and the factors that undo it.

Where performer and rig differ, the ridge of the solve shrinks motion that the blend shapes explain
badly: brows that move sideways as they rise, on a rig whose brows only rise, are solved at half
their size. The mixture of blend shapes is kept; its size is that of a least-squares fit without a
ridge, as in a relaxed fit (N. Meinshausen, "Relaxed Lasso", Computational Statistics & Data
Analysis 52, 2007), as far as no peak is cut off.

Only for the brows: no other region moves their markers. Blend shapes of the mouth are correlated,
so their weights are spread over many shapes, not too small (`python -m benchmarks.shrinkage`).
"""

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.face.head_size import human_size
from usdface.face.marker_surface import MarkerSurface
from usdface.face.regions import named_regions
from usdface.findings import Finding, finding
from usdface.numerics.frame_blocks import frame_blocks
from usdface.retarget.calibrated_shapes import as_performed
from usdface.retarget.exaggeration import scaled_weights
from usdface.retarget.face_fit import FaceFit
from usdface.retarget.motion_model import MotionModel
from usdface.retarget.pins import faded_at_pins
from usdface.retarget.pose_and_weights import PoseAndWeights
from usdface.retarget.solver.solve import FEWEST_FRAMES
from usdface.retarget.wide_bounds import held_peaks
from usdface.setup.pin import Pin
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake

__all__ = [
    "brow_factor",
    "restored",
    "restored_findings",
    "restoring_factors",
]

# RMS displacement of a marker by the brows on a human face [m] at which the factor has half its
# effect: less is noise.
_COUNTS = 0.0005
# Largest factor: markers that move farther are evidence that the rig has no shapes for this motion.
_MOST = 2.0
# Larger factors are reported.
_REPORTED = 1.1


def brow_factor(
    weights: FloatArray,
    displaced: FloatArray,
    motion: MotionModel,
    brows: BoolArray,
    *,
    size: float = 1.0,
) -> float:
    """Return the factor at which the solved brows come nearest to the markers: 1 to 2.

    Parameters
    ----------
    weights : (F, S) float64
        As solved.
    displaced : (F, M, 3) float64 [m]
        Displacements of the markers on the character; NaN where occluded.
    motion : MotionModel
        That the take was solved with, in space: small motions of a moving head say nothing.
    brows : (S,) bool
        The blend shapes of the brows.
    size : float
        Of the face, in human ones.
    """
    rest, model, rigid = motion.points, motion.shapes, motion.head_basis()
    squares, both = np.zeros((2, 2)), np.zeros(2)
    for block in frame_blocks(len(weights)):
        at = displaced[block].reshape(-1, rest.size)
        seen = ~np.isnan(at)
        left = np.where(seen, at - model.displacements(weights[block]), 0.0)
        parts = [model.displacements(weights[block] * own) for own in (brows, ~brows)]
        parts = [np.where(seen, part - (part @ rigid) @ rigid.T, 0.0) for part in parts]
        squares += [[np.vdot(one, other) for other in parts] for one in parts]
        both += [np.vdot(part, left) for part in parts]
    # The rest of the face has a factor of its own, or its shrinkage would look like that of brows
    # that move at the same time; it is not used.
    squares[0, 0] += len(weights) * _markers_moved(model, brows) * (size * _COUNTS) ** 2
    squares += 1e-12 * max(np.trace(squares), 1e-300) * np.eye(2)
    return float(np.clip(1.0 + np.linalg.solve(squares, both)[0], 1.0, _MOST))


def _brow_factors(
    weights: FloatArray,
    times: FloatArray,
    displaced: FloatArray,
    motion: MotionModel,
    names: tuple[str, ...],
    *,
    size: float,
) -> FloatArray:
    """Return the factor of each blend shape, 1 but for those of the brows: (S,).

    So large that no weight goes beyond 1 that did not before. Parameters are those of
    `brow_factor`, for shapes called `names` at `times` (F,) [s].
    """
    brows = np.isin(names, named_regions(names)["brows"])
    factors = np.ones(len(names))
    if brows.any():
        factor = brow_factor(weights, displaced, motion, brows, size=size)
        room = 1.0 / np.maximum(held_peaks(weights[:, brows], times), 1e-12)
        factors[brows] = np.clip(factor, 1.0, np.maximum(room, 1.0))
    return factors


def restoring_factors(
    setup: RetargetSetup,
    fit: FaceFit,
    solved: PoseAndWeights,
    shape_names: tuple[str, ...],
    take: MarkerTake,
    surface: MarkerSurface | None,
) -> FloatArray:
    """Return the factors on the weights of a take (S,) of brows that the solve shrank.

    1 for an image, which has no depth: brows also move forward. Parameters are those of
    `usdface.retarget.take_gains.with_found_gains`, and the surface of the character, whose
    face counts as human without one.
    """
    wanted = setup.solve.shrinkage == "restored" and setup.map.form != "paper"
    if not wanted or take.dimension == 2 or len(take.times) < FEWEST_FRAMES:
        return np.ones(len(shape_names))
    model, _ = as_performed(fit, shape_names, setup)
    motion = MotionModel(fit.points, model, 3, setup.head == "solve")
    size = human_size(surface.mesh) if surface else 1.0
    return _brow_factors(
        solved.weights, take.times, solved.displaced, motion, shape_names, size=size
    )


def restored(
    weights: FloatArray,
    times: FloatArray,
    factors: FloatArray,
    model: BlendShapeEvaluator,
    names: tuple[str, ...],
    pins: tuple[Pin, ...],
) -> FloatArray:
    """Return weights (F, S) with the factors (S,) of their blend shapes; pins stay."""
    if (factors == 1.0).all():
        return weights
    larger = scaled_weights(weights, np.broadcast_to(factors, weights.shape), model)
    larger = faded_at_pins(pins, names, times, weights, larger)
    return model.complete(larger[:, model.free])


def restored_findings(factors: FloatArray) -> list[Finding]:
    """Report brows that the factors (S,) made larger."""
    most = float(factors.max(initial=1.0))
    if most <= _REPORTED:
        return []
    message = "the solve made them too small; scaled up by up to {factor:.2f}"
    return [finding("BROWS_RESTORED", "brows", message, most)]


def _markers_moved(model: BlendShapeEvaluator, brows: BoolArray) -> float:
    """Return the effective number of markers that the brows move: a participation ratio."""
    squares = (model.offsets[brows] ** 2).sum(axis=0).reshape(-1, 3).sum(axis=1)
    return float(squares.sum() ** 2 / max((squares**2).sum(), 1e-300))
