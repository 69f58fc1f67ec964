"""Calibration of a performer: the size of movements relative to the character's, from a take.

The whole take is solved with weights that may go beyond 0 and 1, which gives ``u = gain * weight -
offset`` of each shape. How far u goes up bounds the gain (`usdface.retarget.gain_posterior`); how
far it goes below 0 is how far the neutral frames were from rest. The idea of gains from a
range-of-motion take is Ribera et al. 2017, "Facial Retargeting with Automatic Range of Motion
Alignment", section 4; a gain per shape, bounded and with a prior, is all that is learned here, so
that a shape keeps its meaning.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtri

from usdface.arrays import FloatArray, freeze
from usdface.errors import InputError
from usdface.face.marker_surface import MarkerSurface
from usdface.findings import Finding, finding
from usdface.options import (
    EXTREME_REACHED,
    LARGEST_OFFSET,
    OFFSET_SPREAD,
    PERFORMER_GAIN_RANGE,
    PERFORMER_GAIN_SPREAD,
)
from usdface.retarget.bound_points import BoundPoints
from usdface.retarget.gain_posterior import gain_posterior
from usdface.retarget.performed_face import face_of_solution
from usdface.retarget.solution import Solution
from usdface.retarget.solve_take import solve_take
from usdface.retarget.solver.regularisation import Regularisation
from usdface.retarget.solver.solve import FEWEST_FRAMES
from usdface.retarget.wide_bounds import (
    AT_REST,
    held_peaks,
    resting_weights,
    weights_in_wide_bounds,
)
from usdface.setup.calibration import Calibration
from usdface.setup.performer_face import PerformerFace
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake

__all__ = ["TakeCalibration", "calibrate_take"]

# Noise alone goes so many standard deviations below rest there: the normal quantile.
_BY_NOISE = -float(ndtri(AT_REST))
# A gain is known if the take leaves less than this share of the prior's deviation: a quarter
# of its variance.
_KNOWN = 0.5
# A movement is active beyond so many deviations of noise: one in 700 by chance.
_UNLIKE = 3.0
# Gains in the summary.
_SHOWN = 5


@dataclass(frozen=True, eq=False, slots=True)
class TakeCalibration:
    """The calibration of a performer, from a take.

    Attributes
    ----------
    calibration : Calibration
        Of all shapes with a weight of their own; 1 for those that the take does not determine.
    deviations : (S,) float64
        Standard deviation of each gain; that of the prior, 0.2, where nothing is known.
    peaks : (S,) float64
        Peak of each shape, in weights of the character, 1 and more where it goes beyond.
    solution : Solution
        The take as solved without calibration.
    """

    calibration: Calibration
    deviations: FloatArray
    peaks: FloatArray
    solution: Solution

    def __post_init__(self) -> None:
        freeze(self, "deviations", "peaks")

    def summary(self) -> dict[str, dict[str, float]]:
        """Return the gains that are known and differ most from 1, under the key ``gains``."""
        found = self.calibration
        sizes = dict(zip(found.shapes, found.gains.tolist(), strict=True))
        most = sorted(self.known, key=lambda name: (-abs(sizes[name] - 1.0), name))[:_SHOWN]
        return {"gains": {name: round(sizes[name], 2) for name in most}}

    @property
    def known(self) -> tuple[str, ...]:
        """Shapes whose gain the take shows."""
        determined = self.deviations < _KNOWN * PERFORMER_GAIN_SPREAD
        return tuple(n for n, s in zip(self.calibration.shapes, determined, strict=True) if s)


def calibrate_take(
    take: MarkerTake,
    bound: BoundPoints,
    setup: RetargetSetup,
    extremes: bool = False,
    surface: MarkerSurface | None = None,
) -> tuple[TakeCalibration, list[Finding]]:
    """Find a performer's face, and their gains and offsets relative to it, from a take.

    Parameters are those of `usdface.retarget.solve_take.solve_take`.

    Parameters
    ----------
    extremes : bool
        The take goes through the performer's whole range of motion, each movement to its
        extreme. Without that only gains above 1 are learned.

    Raises
    ------
    InputError
        If the take is too short.
    SolveError
        If the bound markers do not determine an answer.
    """
    if len(take.times) < FEWEST_FRAMES:
        raise InputError(
            f"the take {take.source} has {len(take.times)} frames; a calibration needs a range "
            f"of motion of at least {FEWEST_FRAMES}",
            "TAKE_SHORT",
        )
    model, shape_names = bound.model, bound.shape_names
    # The file's offsets are the neutral frames' expression.
    own = replace(setup.solve, gains="given", shrinkage="kept", neutral="given", errors="alike")
    setup = replace(setup, solve=own)
    uncalibrated = replace(setup, calibration=None)
    solution, findings = solve_take(
        take,
        bound,
        uncalibrated,
        surface=surface,
        correct_neutral=False,  # the offsets are its error
    )
    free = model.free
    names = tuple(shape_names[s] for s in free)
    weights, deviations = _weights_in_wide_bounds(solution, setup)
    low, high = resting_weights(weights, model.offsets[free]), held_peaks(weights, take.times)
    shrunk = OFFSET_SPREAD**2 / (OFFSET_SPREAD**2 + deviations**2)
    rest = np.clip((-low - _BY_NOISE * deviations) * shrunk, 0.0, LARGEST_OFFSET)
    if setup.neutral is None:  # measured from the rig's own neutral, which is at rest
        rest = np.zeros_like(rest)
    peaks = high + rest
    gains, spreads = gain_posterior(peaks, deviations, EXTREME_REACHED if extremes else 0.0)
    face, unknown = None, list[Finding]()
    seen = setup.solve.places == "found" and setup.map.form != "paper" and solution.dimension == 3
    if surface is not None and seen:
        sized = Calibration(names, gains, np.zeros(len(names)))
        face, unknown = _face(take, bound, replace(setup, calibration=sized), sized, surface)
    calibrated = TakeCalibration(Calibration(names, gains, rest, face), spreads, peaks, solution)
    findings += unknown + _findings(calibrated, deviations, take.source, extremes)
    return calibrated, findings


def _face(
    take: MarkerTake,
    bound: BoundPoints,
    setup: RetargetSetup,
    calibration: Calibration,
    surface: MarkerSurface,
) -> tuple[PerformerFace, list[Finding]]:
    """Return places of the markers and their displacements by shapes, solved with known gains."""
    model, shape_names = bound.model, bound.shape_names
    solution, _ = solve_take(take, bound, setup, surface=surface)
    used = [setup.binding.markers.index(name) for name in solution.markers]
    frames = setup.neutral[1] - setup.neutral[0] + 1 if setup.neutral else 0
    face, found = face_of_solution(
        solution,
        setup.binding.points[used],
        frames,
        gains=calibration.of(shape_names)[0],
    )
    unknown = [shape_names[shape] for shape in model.free if not found.known[shape]]
    if not unknown:
        return face, []
    message = (
        "the take does not show how the performer makes {shapes}; they are the character's, in the "
        "proportions of the performer's face"
    )
    return face, [finding("DIRECTION_UNKNOWN", take.source, message, unknown)]


def _weights_in_wide_bounds(
    solution: Solution, setup: RetargetSetup
) -> tuple[FloatArray, FloatArray]:
    """Solve the markers as mapped, with weights that may leave 0 to 1: (F, S), (S,)."""
    return weights_in_wide_bounds(
        solution.displacements[..., : solution.dimension],
        solution.motion_model,
        solution.weights.times,
        # Without names and size, so without the terms of weights in 0 to 1: restraint would drive
        # weights further below 0 that may be there.
        Regularisation(solution.noise, solution.misfit, setup.solve),
        within=(-LARGEST_OFFSET, PERFORMER_GAIN_RANGE[1]),
    )


def _findings(
    calibrated: TakeCalibration, deviations: FloatArray, where: str, extremes: bool
) -> list[Finding]:
    names, known = calibrated.calibration.shapes, set(calibrated.known)
    still = calibrated.peaks < np.maximum(_UNLIKE * deviations, 0.1)
    quiet = [n for n, s in zip(names, still, strict=True) if s and n not in known]
    open_ = [n for n in names if n not in known and n not in quiet]
    found = []
    if quiet:
        message = "{shapes} never move clearly in this take; their gains stay about 1"
        found.append(finding("GAIN_UNSEEN", where, message, quiet))
    if open_:
        message = (
            "the take does not determine the gains of {shapes}: small movements and low gains look "
            "alike"
        )
        if not extremes:
            message += "; --extremes reads them from a range of motion"
        found.append(finding("GAIN_UNKNOWN", where, message, open_))
    return found
