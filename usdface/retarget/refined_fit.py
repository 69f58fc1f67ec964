"""Fits of a performer judged by the motion of a take: places refined, the best of several."""

from collections.abc import Callable, Sequence

import numpy as np

from usdface.arrays import FloatArray
from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.face.marker_surface import MarkerSurface
from usdface.geometry.rigid_modes import motion_basis
from usdface.numerics.ramps import smooth_step
from usdface.options import MapOptions
from usdface.retarget.face_fit import FaceFit, PlacedFit, fit_places, fit_transferred
from usdface.retarget.motion_errors import MotionErrors
from usdface.retarget.motion_evidence import MotionEvidence
from usdface.retarget.places import guess_in_motion, search_in_motion
from usdface.retarget.pose_and_weights import PoseAndWeights
from usdface.takes import visible

__all__ = ["best_fit", "refine_places"]

# Another fit is taken if its misfit is below this factor times that of the first: less, by more
# than rounding. With 22 files of performers that the solve was built with, the fit of less misfit
# gives better weights in 18, in the other four worse by 0.0003 to 0.004; of two real takes on
# three heads, all six are explained better.
_LESS_MISFIT = 0.99
# A marker moves unlike its place if its residual is so many times the median marker's: in part from
# the first number on, or one frame more would move it by a vertex; wholly from the second. By hand.
_UNLIKE = 1.5, 2.5
# Times that places are refined and the take is solved again, as long as its misfit falls. Of 2, 3
# and 4 on performers 1 to 4 of python -m benchmarks.performers, 10 and 20 s, with places off by
# 4 mm: skin 0.187, 0.183 and 0.183 mm.
_STEPS = 3


def best_fit(fits: Sequence[FaceFit], misfit: Callable[[FaceFit], float]) -> tuple[FaceFit, float]:
    """Return the fit that explains the motion of a take best.

    Parameters
    ----------
    fits : sequence of FaceFit
        The first is kept unless another one is better.
    misfit : callable
        Of a solve with a fit [m].

    Returns
    -------
    FaceFit
    float
        Its misfit, by that of the first fit; 1 for the first.
    """
    first, *others = fits
    before = misfit(first) if others else 0.0
    for other in others:
        after = misfit(other)
        if after < _LESS_MISFIT * before:
            return other, after / before
    return first, 1.0


def refine_places(
    fit: FaceFit,
    neutral: FloatArray,
    options: MapOptions,
    evidence: MotionEvidence,
    surface: MarkerSurface,
    *,
    solve: Callable[[FaceFit], PoseAndWeights],
    sized: Callable[[BlendShapeEvaluator], BlendShapeEvaluator],
    moving_head: bool,
) -> FaceFit:
    """Return the fit with places that better explain the motion of a take, if there are any.

    Parameters are those of `fit_face`.

    Parameters
    ----------
    solve : callable
        Solves frames of the take with a fit.
    sized : callable
        Returns the shapes at the performer's gains, which the weights refer to.
    moving_head : bool
        The head's pose is solved with the weights.
    """
    if not isinstance(fit, PlacedFit):
        return fit
    solved = solve(fit)
    for _ in range(_STEPS):
        if solved.regularisation.variance == 0.0:
            break
        skin = fit.transferred or surface
        shifts = _refined_shifts(fit, skin, solved, sized, moving_head)
        if fit.transferred:
            refined = fit_transferred(fit, neutral, shifts, skin)
        else:
            refined = fit_places(neutral, shifts, options, evidence, surface, fit.guess)
        again = solve(refined)
        if again.regularisation.misfit >= solved.regularisation.misfit:
            break
        fit, solved = refined, again
    return fit


def _refined_shifts(
    fit: PlacedFit,
    surface: MarkerSurface,
    solved: PoseAndWeights,
    sized: Callable[[BlendShapeEvaluator], BlendShapeEvaluator],
    moving_head: bool,
) -> FloatArray:
    """Return shifts (M, 3) [m] that the solved frames make more probable than those of `fit`."""
    weights, displaced = solved.weights, solved.displaced
    rigid = motion_basis(fit.points, 3) if moving_head else np.zeros((fit.points.size, 0))
    placed = fit.placed.mapped(sized)
    errors = MotionErrors.of(solved.regularisation, weights, placed.evaluator.offsets, displaced)
    shifts = guess_in_motion(fit.guess, fit.shifts, placed, errors, displaced, rigid)
    residual = displaced - placed.evaluator.displacements(weights).reshape(displaced.shape)
    seen = visible(displaced)
    squares = np.where(seen, (residual**2).sum(axis=2), 0.0).sum(axis=0)
    away = np.sqrt(squares / np.maximum(seen.sum(axis=0), 1))
    begin, full = _UNLIKE
    unlike = smooth_step((away / max(float(np.median(away)), 1e-300) - begin) / (full - begin))
    for marker in np.flatnonzero(unlike):
        found = search_in_motion(fit.guess, surface, int(marker), errors, displaced, sized)
        shifts[marker] += unlike[marker] * (found - shifts[marker])
    return shifts
