"""Fit of performer to character: the places of the markers and the space map between the two."""

from dataclasses import dataclass, replace

import numpy as np

from usdface.arrays import FloatArray
from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.face.marker_surface import MarkerSurface, PlacedMarkers
from usdface.face.transferred_shapes import transferred_surface
from usdface.geometry.rigid_fit import similarity_fit
from usdface.options import MapOptions
from usdface.retarget.map_choice import MapChoice, choose_map
from usdface.retarget.motion_evidence import MotionEvidence
from usdface.retarget.places import MOST_MARKERS, PlaceGuess, guess_at_rest
from usdface.retarget.rbf import SpaceMap

__all__ = [
    "TRANSFER",
    "FaceFit",
    "PlacedFit",
    "fit_at_places",
    "fit_face",
    "fit_in_head_space",
    "fit_places",
    "fit_transferred",
]

# Name of the map that maps displacements by the similarity, to the performer's own shapes.
TRANSFER = "similarity, shapes transferred"
# Places estimated from the neutral are taken if they leave at most this share of the motion
# unexplained: between two people the neutrals differ mostly by the faces themselves. Set by hand.
_BETTER = 0.95
# The performer's own shapes are taken if the motion that they leave unexplained is below this
# factor times that of every map. Set by hand: they leave 2 to 20 % less where they are right, and
# more where another map is.
_TRANSFERRED = 0.99


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
    """

    points: FloatArray
    evaluator: BlendShapeEvaluator
    space: SpaceMap
    choice: MapChoice
    shifts: FloatArray


@dataclass(frozen=True, eq=False, slots=True)
class PlacedFit(FaceFit):
    """A fit whose places the motion of a take may still refine: others stay as they are.

    Attributes
    ----------
    placed : PlacedMarkers
        The places with slopes along the skin.
    guess : PlaceGuess
        Their distribution before the take's motion was used.
    transferred : MarkerSurface or None
        The skin with the blend shapes of the performer's face, where these carry the motion.
    """

    placed: PlacedMarkers
    guess: PlaceGuess
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
    if guess.on_vertices(surface):
        return bound
    beside = fit_places(neutral, guess.mean, options, evidence, surface, guess)
    there = evidence.unexplained_share(beside.space, beside.points, beside.evaluator)
    fit = beside
    if not there < _BETTER * share(space):
        fit = fit_places(neutral, bound.shifts, options, evidence, surface, guess.centred())
    return _as_another_face(neutral, fit, options, evidence, surface)


def fit_in_head_space(
    neutral: FloatArray, points: FloatArray, evaluator: BlendShapeEvaluator
) -> FaceFit:
    """Lay a filmed performer over a character to which the head was aligned in space.

    Displacements in the image are the performer's own, and those of the skin there as the camera
    sees them: nothing is bent.

    Parameters
    ----------
    neutral : (M, 2) float64 [m]
        The performer's resting markers in head space, without depths.
    points : (M, 3) float64 [m]
        The vertices that they are bound to.
    evaluator : BlendShapeEvaluator
        Of displacements there.
    """
    straight, none = np.eye(3)[:2], np.zeros_like(points)
    offset = (points - neutral @ straight).mean(axis=0)
    space = SpaceMap(neutral, none, straight, offset, "gaussian", 1.0, local=True)
    return FaceFit(points, evaluator, space, MapChoice("similarity"), none)


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
    fit: PlacedFit,
    options: MapOptions,
    evidence: MotionEvidence,
    surface: MarkerSurface,
) -> PlacedFit:
    """Return the fit with the shapes transferred to the performer, if motion is evidence for it.

    Displacements are then mapped by the similarity.
    """
    if options.choice == "fixed":
        return fit
    linear, offset = similarity_fit(neutral, fit.points)
    skin = transferred_surface(surface, fit.placed, neutral @ linear + offset)
    if skin is None:
        return fit
    transferred = fit_transferred(fit, neutral, fit.shifts, skin)
    unexplained = evidence.unexplained_share(
        transferred.space, transferred.points, transferred.evaluator
    )
    if not unexplained < _TRANSFERRED * min(fit.choice.unexplained.values(), default=np.nan):
        return fit
    shares = {**fit.choice.unexplained, TRANSFER: unexplained}
    return replace(transferred, choice=replace(fit.choice, name=TRANSFER, unexplained=shares))


def fit_transferred(
    fit: PlacedFit, neutral: FloatArray, shifts: FloatArray, surface: MarkerSurface
) -> PlacedFit:
    """Return the fit with other places on a skin that moves as the performer's face does.

    Parameters
    ----------
    fit : PlacedFit
        With transferred blend shapes.
    neutral : (M, 3) float64
        The performer's markers at rest.
    shifts : (M, 3) float64 [m]
        Of the places from their vertices.
    surface : MarkerSurface
        Of that skin.
    """
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
) -> PlacedFit:
    """Fit a performer to a character with markers beside their vertices.

    Parameters
    ----------
    neutral : (M, D) float64
        The performer's markers at rest.
    shifts : (M, 3) float64 [m]
        Of the places from their vertices.
    options : MapOptions
    evidence : MotionEvidence
        By which the space map is chosen.
    surface : MarkerSurface
    guess : PlaceGuess
        The distribution of the shifts, which the fit keeps.
    """
    shifts = surface.within_reach(shifts)
    placed = surface.at(shifts)

    def share(space: SpaceMap) -> float:
        return evidence.unexplained_share(space, placed.points, placed.evaluator)

    space, choice = choose_map(neutral, placed.points, options, share)
    return PlacedFit(placed.points, placed.evaluator, space, choice, shifts, placed, guess)
