"""Performer laid over character: the places of the markers and the space map between the two."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from usdface.arrays import FloatArray
from usdface.blend_shape_evaluator import BlendShapeEvaluator
from usdface.face.marker_surface import MarkerSurface, PlacedMarkers
from usdface.face.transferred_shapes import transferred_surface
from usdface.geometry.rigid_fit import similarity_fit
from usdface.geometry.rigid_modes import motion_basis
from usdface.options import MapOptions
from usdface.retarget.map_choice import MapChoice, choose_map
from usdface.retarget.motion_evidence import MotionEvidence
from usdface.retarget.places import (
    MOST_MARKERS,
    PlaceGuess,
    guess_at_rest,
    guess_in_motion,
    search_in_motion,
)
from usdface.retarget.pose_and_weights import PoseAndWeights
from usdface.retarget.rbf import SpaceMap
from usdface.takes import visible

__all__ = [
    "TRANSFER",
    "FaceFit",
    "best_fit",
    "fit_at_places",
    "fit_face",
    "fit_places",
    "refine_places",
]

# Name of the map that carries displacements by the similarity, to the performer's own shapes.
TRANSFER = "similarity, shapes transferred"
# Places estimated from the neutral are taken if they leave at most this share of the motion
# unexplained: between two people the neutrals differ mostly by the faces themselves. Set by hand.
_BETTER = 0.95
# The performer's own shapes are taken if the motion that they leave unexplained is below this
# factor times that of every map. Set by hand: they leave 2 to 20 % less where they are right, and
# more where another map is.
_TRANSFERRED = 0.99
# Another fit is taken if its misfit is below this factor times that of the first. On the performers
# that the solve was built with, a file of 20 s and of 67 s, that of a worse fit is 1.3 to 4.5 times
# as large, but for one of 1.15.
_LESS_MISFIT = 0.85
# Markers are on their vertices if they err by less than this share of the face's size at rest.
_EXACT = 1e-6
# A marker moves unlike its place if its residual is so many times the median marker's. Set by hand.
_UNLIKE = 2.0
# Times that places are refined and the take is solved again. Of 1, 2 and 3, 2 was enough on the
# performers of python -m benchmarks.performers that the solve was built with.
_STEPS = 2


@dataclass(frozen=True, eq=False, slots=True)
class FaceFit:
    """The markers on the character, and the map of their displacements.

    Attributes
    ----------
    points : (M, 3) float64 [m]
        Neutral places on the character.
    evaluator : BlendShapeEvaluator
        Of displacements there, N = 3 M.
    space : SpaceMap
    choice : MapChoice
    shifts : (M, 3) float64 [m]
        From the vertices that the markers are bound to.
    placed : PlacedMarkers or None
        The same with slopes along the skin; None for markers on their vertices for good.
    guess : PlaceGuess or None
        The places' distribution before the take's motion was used.
    transferred : MarkerSurface or None
        The skin with the blend shapes of the performer's face, where these carry the motion.
    """

    points: FloatArray
    evaluator: BlendShapeEvaluator
    space: SpaceMap
    choice: MapChoice
    shifts: FloatArray
    placed: PlacedMarkers | None = None
    guess: PlaceGuess | None = None
    transferred: MarkerSurface | None = None


def fit_face(
    neutral: FloatArray,
    points: FloatArray,
    evaluator: BlendShapeEvaluator,
    options: MapOptions,
    evidence: MotionEvidence,
    surface: MarkerSurface | None,
) -> FaceFit:
    """Lay a performer over a character, before any solve.

    Parameters
    ----------
    neutral : (M, D) float64
        The performer's resting markers.
    points : (M, 3) float64 [m]
        The vertices that they are bound to.
    evaluator : BlendShapeEvaluator
        Of displacements there.
    options : MapOptions
    evidence : MotionEvidence
    surface : MarkerSurface or None
        The skin around those vertices; None = markers sit on them.

    Raises
    ------
    SolveError
        If there are too few markers, or they coincide.
    """

    def share(space: SpaceMap) -> float:
        return evidence.unexplained_share(space, points, evaluator)

    space, choice = choose_map(neutral, points, options, share)
    bound = FaceFit(points, evaluator, space, choice, np.zeros_like(points))
    flat = neutral.shape[1] != 3
    if surface is None or flat or len(points) > MOST_MARKERS or options.form == "paper":
        return bound
    guess = guess_at_rest(neutral, points)
    if guess.spread <= _EXACT * surface.reach:
        return bound
    beside = fit_places(neutral, guess.mean, options, evidence, surface, guess)
    there = evidence.unexplained_share(beside.space, beside.points, beside.evaluator)
    fit = beside
    if not there < _BETTER * share(space):
        fit = fit_places(neutral, bound.shifts, options, evidence, surface, guess.centred())
    return _as_another_face(neutral, fit, options, evidence, surface)


def fit_at_places(
    neutral: FloatArray,
    guess: PlaceGuess,
    options: MapOptions,
    evidence: MotionEvidence,
    surface: MarkerSurface,
) -> FaceFit:
    """Lay a performer over a character with markers at the places of a guess, before any solve.

    Parameters are those of `fit_face`; `guess` is known from elsewhere.
    """
    fit = fit_places(neutral, guess.mean, options, evidence, surface, guess)
    return _as_another_face(neutral, fit, options, evidence, surface)


def _as_another_face(
    neutral: FloatArray,
    fit: FaceFit,
    options: MapOptions,
    evidence: MotionEvidence,
    surface: MarkerSurface,
) -> FaceFit:
    """Return the fit with the shapes transferred to the performer, if motion is evidence for it.

    Displacements are then carried by the similarity.
    """
    assert fit.placed is not None
    if options.choice == "fixed":
        return fit
    linear, offset = similarity_fit(neutral, fit.points)
    skin = transferred_surface(surface, fit.placed, neutral @ linear + offset)
    if skin is None:
        return fit
    transferred = _placed(fit, neutral, fit.shifts, skin)
    unexplained = evidence.unexplained_share(
        transferred.space, transferred.points, transferred.evaluator
    )
    if not unexplained < _TRANSFERRED * min(fit.choice.unexplained.values(), default=np.nan):
        return fit
    shares = {**fit.choice.unexplained, TRANSFER: unexplained}
    return replace(transferred, choice=replace(fit.choice, name=TRANSFER, unexplained=shares))


def _placed(
    fit: FaceFit, neutral: FloatArray, shifts: FloatArray, surface: MarkerSurface
) -> FaceFit:
    """Return the fit with other places on a skin that moves as the performer's face does."""
    shifts = surface.within_reach(shifts)
    placed = surface.at(shifts)
    linear, offset = similarity_fit(neutral, placed.points)
    space = SpaceMap(
        neutral, np.zeros_like(placed.points), linear, offset, fit.space.kernel, fit.space.radius,
        local=True,
    )  # fmt: skip
    return replace(
        fit, points=placed.points, evaluator=placed.evaluator, space=space, shifts=shifts,
        placed=placed, transferred=surface,
    )  # fmt: skip


def fit_places(
    neutral: FloatArray,
    shifts: FloatArray,
    options: MapOptions,
    evidence: MotionEvidence,
    surface: MarkerSurface,
    guess: PlaceGuess,
) -> FaceFit:
    """Lay a performer over a character with markers beside their vertices by `shifts` (M, 3)."""
    shifts = surface.within_reach(shifts)
    placed = surface.at(shifts)

    def share(space: SpaceMap) -> float:
        return evidence.unexplained_share(space, placed.points, placed.evaluator)

    space, choice = choose_map(neutral, placed.points, options, share)
    return FaceFit(placed.points, placed.evaluator, space, choice, shifts, placed, guess)


def best_fit(fits: Sequence[FaceFit], misfit: Callable[[FaceFit], float]) -> tuple[FaceFit, float]:
    """Return the fit that explains the motion of a take best.

    Parameters
    ----------
    fits : sequence of FaceFit
        The first is kept unless another one is clearly better.
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
    head_moves: bool,
) -> FaceFit:
    """Return the fit with places that better explain the motion of a take, if there are any.

    Parameters are those of `fit_face`.

    Parameters
    ----------
    solve : callable
        Solves frames of the take with a fit.
    sized : callable
        Returns the shapes at the performer's amplitudes, which the weights refer to.
    head_moves : bool
        The head's pose is solved with the weights.
    """
    if fit.placed is None:
        return fit
    joint = solve(fit)
    for _ in range(_STEPS):
        if joint.regularisation.variance == 0.0:
            break
        assert fit.guess is not None
        skin = fit.transferred or surface
        shifts = _refined_shifts(fit, skin, joint, sized, head_moves)
        if fit.transferred:
            refined = _placed(fit, neutral, shifts, skin)
        else:
            refined = fit_places(neutral, shifts, options, evidence, surface, fit.guess)
        again = solve(refined)
        if again.regularisation.misfit >= joint.regularisation.misfit:
            break
        fit, joint = refined, again
    return fit


def _refined_shifts(
    fit: FaceFit,
    surface: MarkerSurface,
    joint: PoseAndWeights,
    sized: Callable[[BlendShapeEvaluator], BlendShapeEvaluator],
    head_moves: bool,
) -> FloatArray:
    """Return shifts (M, 3) [m] that the solved frames make more probable than those of `fit`."""
    assert fit.placed is not None and fit.guess is not None
    weights, displaced = joint.weights, joint.displaced
    variance = joint.regularisation.variance
    rigid = motion_basis(fit.points, 3) if head_moves else np.zeros((fit.points.size, 0))
    placed = fit.placed.mapped(sized)
    shifts = guess_in_motion(fit.guess, fit.shifts, placed, weights, displaced, rigid, variance)
    residual = displaced - placed.evaluator.displacements(weights).reshape(displaced.shape)
    seen = visible(displaced)
    squares = np.where(seen, (residual**2).sum(axis=2), 0.0).sum(axis=0)
    away = np.sqrt(squares / np.maximum(seen.sum(axis=0), 1))
    for marker in np.flatnonzero(away > _UNLIKE * np.median(away)):
        shifts[marker] = search_in_motion(
            fit.guess, surface, int(marker), weights, displaced, sized, variance
        )
    return shifts
