"""One round of the joint solve: weights in the pose so far, pose and gaps by their residual.

The weights are solved with small head motions projected out of the problem (so that one normal
matrix serves the whole take); the residual is then taken as the pose's error. Occluded markers are
filled with the rig's prediction and the residual that they had before and have after
(`usdface.retarget.occluded_residual`).
"""

from dataclasses import dataclass, field, replace

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.geometry.gap_interpolation import interpolate_gaps
from usdface.geometry.rigid_fit import POSE_MARKERS, Pose, rigid_fit
from usdface.numerics.rms import rms
from usdface.retarget.occluded_residual import occluded_residual
from usdface.retarget.rbf import SpaceMap
from usdface.retarget.solver.regularisation import Regularisation
from usdface.retarget.solver.residual_space import ResidualSpace
from usdface.retarget.solver.solve import Iterate
from usdface.retarget.take_rows import TakeRows

__all__ = ["ObservedTake", "SolveRound", "measured", "next_round"]

# First rounds, in which occluded markers are interpolated in time, until the head's pose has
# settled. What they are filled with in a wrong pose is kept for long: a gap of 5 frames over
# AnimFace's open jaw steps by 1.6 mm with 4 of these rounds, by 0.09 mm with 10.
_HELD = 10
# Rounds in which noise is estimated: then the pose's own error is far below it.
_NOISE_ROUNDS = 4
# The rounds have settled when markers on the character move by less than this share of their error,
# or this far [m]: further rounds would change weights by a hundredth of their error.
_SETTLED_SHARE = 0.01
_SETTLED = 1e-9


@dataclass(frozen=True, eq=False, slots=True)
class ObservedTake:
    """The markers of a take as observed, and the equations that all rounds share.

    Attributes
    ----------
    times : (F,) float64 [s]
    markers : (F, M, 3) float64 [of the take]
        NaN where occluded; an image has depth 0.
    seen : (F, M) bool
    rows : TakeRows
    linear : (3, 3) float64 or None
        The similarity from the take to the character, without its offset, where the head's pose is
        solved; None where it is known.
    residual_space : ResidualSpace or None
        Noise and misfit of the typical marker are measured on it; None where they are known.
    least_noise : float [m]
    occluded : (F, M * axes) bool
        Coordinates of the rows that are occluded.
    """

    times: FloatArray
    markers: FloatArray
    seen: BoolArray
    rows: TakeRows
    linear: FloatArray | None
    residual_space: ResidualSpace | None
    least_noise: float
    occluded: BoolArray = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "occluded", np.repeat(~self.seen, self.rows.axes, axis=1))


@dataclass(frozen=True, eq=False, slots=True)
class SolveRound:
    """The joint solution after a round.

    Attributes
    ----------
    number : int
        0 before the first.
    pose : Pose
    here : (F, M, 3) float64 [of the take]
        The markers of a head that stays still.
    space : SpaceMap
    regularisation : Regularisation
        With noise and misfit.
    occluded_residual : (F, M * axes) float64 [m]
        Residual of occluded markers.
    least_misfit : float [m]
    iterate : Iterate or None
        The weights; None before the first round.
    observed, residual : (F, M * axes) float64 [m]
        Displacements of the markers, without gaps, and beyond those of the weights.
    moved : float [m]
        RMS distance by which the round moved markers on the character.
    """

    number: int
    pose: Pose
    here: FloatArray
    space: SpaceMap
    regularisation: Regularisation
    occluded_residual: FloatArray
    least_misfit: float = 0.0
    iterate: Iterate | None = None
    observed: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    residual: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    moved: float = np.inf

    def settled(self, take: ObservedTake) -> bool:
        """Whether further rounds would hardly change the weights."""
        if take.occluded.any() and self.number <= _HELD:
            return False
        error = max(self.regularisation.noise, self.regularisation.misfit)
        return self.moved < max(_SETTLED_SHARE * error, _SETTLED)

    def displaced(
        self, take: ObservedTake, iterate: Iterate | None
    ) -> tuple[FloatArray, FloatArray]:
        """Carry the markers of a still head over to the character.

        Return their displacements (F, M, 3) with gaps, and flat (F, M * axes) without: those of
        occluded markers by an iterate, or interpolated in time.
        """
        rows = take.rows
        displaced = self.space.displacements(self.here[..., : rows.axes])
        observed = displaced[..., : rows.axes].reshape(len(displaced), -1)
        occluded = np.isnan(observed)
        if not occluded.any():
            return displaced, observed
        if iterate is None:
            # A marker that no frame of a piece shows begins at rest.
            return displaced, np.nan_to_num(interpolate_gaps(observed, occluded, take.times))
        predicted = rows.displacements(iterate.weights) + self.occluded_residual
        return displaced, np.where(occluded, predicted, observed)


def measured(take: ObservedTake, before: SolveRound) -> SolveRound:
    """Begin the next round: displacements of the markers, and their noise and misfit."""
    number = before.number + 1
    _, observed = before.displaced(take, before.iterate if number > _HELD else None)
    found = replace(before, number=number, observed=observed)
    if take.residual_space is None:
        return found
    noise, least_misfit = before.regularisation.noise, before.least_misfit
    weighted = observed / take.rows.errors
    if number <= _NOISE_ROUNDS:
        own = take.residual_space.noise(weighted)
        noise = max(own, take.least_noise)
        least_misfit = take.residual_space.least_misfit(weighted, own)
    # An error of the pose in the first rounds resembles misfit.
    misfit = max(take.residual_space.misfit(weighted, noise), least_misfit)
    regularisation = replace(before.regularisation, noise=noise, misfit=misfit)
    return replace(found, regularisation=regularisation, least_misfit=least_misfit)


def next_round(take: ObservedTake, before: SolveRound) -> SolveRound:
    """Solve weights and head pose once more."""
    begun = measured(take, before)
    rows, observed, regularisation = take.rows, begun.observed, begun.regularisation
    iterate = rows.solve(observed, take.times, regularisation, before.iterate)
    residual = observed - rows.displacements(iterate.weights)
    # Over all coordinates, as the error is: fills of few markers change few.
    moved = rms(np.where(take.occluded, residual - before.occluded_residual, 0.0))
    found = replace(begun, iterate=iterate, residual=residual, moved=moved)
    if take.occluded.any():
        noise, misfit = regularisation.noise, regularisation.misfit
        kept = occluded_residual(residual, take.occluded, take.times, noise=noise, misfit=misfit)
        found = replace(found, occluded_residual=kept)
    return found if take.linear is None else _posed(take, found, take.linear)


def _posed(take: ObservedTake, found: SolveRound, linear: FloatArray) -> SolveRound:
    """Return the round with the pose of the markers without their residual.

    Occluded markers of a frame in which others determine a pose take part where they are expected,
    so that the pose does not jump as they vanish.
    """
    posed = take.seen.sum(axis=1) >= POSE_MARKERS
    if not posed.any():  # a piece of a take, without the face
        return found
    back, here, shape = np.linalg.inv(linear), found.here, (*take.seen.shape, -1)
    seen = take.seen[..., None]
    there = np.where(seen, here, found.space.centres + found.observed.reshape(shape) @ back)
    kept = np.where(posed[:, None, None], found.pose.to_take(there), np.nan)
    rested = there - found.residual.reshape(shape) @ back
    pose = rigid_fit(rested, np.where(seen, take.markers, kept), take.rows.marker_weights)[0]
    now = pose.to_head(take.markers)
    moved = max(found.moved, rms((now - here)[take.seen] @ linear))
    return replace(found, pose=pose, here=now, moved=moved)
