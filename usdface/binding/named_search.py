"""Registration of named markers: from the places of their names, which are checked against it."""

from dataclasses import dataclass, replace

import numpy as np

from usdface.arrays import BoolArray, frozen
from usdface.binding.face_surface import FaceSurface
from usdface.binding.name_priors import FEWEST_NAMED, NamePriors, named_pose
from usdface.binding.observations import Observations
from usdface.binding.pose_search import RegisteredMarkers, register_from, search_pose
from usdface.binding.registration import predicted_by_others

__all__ = ["NameCheck", "register_markers"]

# A name is contradicted where the marker lies so many standard deviations from its place, by the
# places of the others. Set by hand; judge: `python benchmarks/binding.py named`.
_CONTRADICTED = 4.0
# Names are used where this share of them lies within three deviations of one pose.
_AGREEING, _WITHIN = 0.6, 9.0
# Left and right are exchanged where that leaves less than this share of the error.
_EXCHANGED = 0.5
# An error counts up to this square: a few wrong names do not decide on all.
_MOST = 25.0
# Rounds of registering and of leaving out contradicted names.
_ROUNDS = 3


@dataclass(frozen=True, eq=False, slots=True)
class NameCheck:
    """Contradictions between the names of markers and where they lie.

    Attributes
    ----------
    contradicted : (M,) bool
        Markers that lie elsewhere than their name tells.
    exchanged : bool
        The names tell the other side on the whole face.
    used : bool
        False where the names as a whole fit no face, and places were found without them.
    """

    contradicted: BoolArray
    exchanged: bool = False
    used: bool = True

    def __post_init__(self) -> None:
        object.__setattr__(self, "contradicted", frozen(self.contradicted, np.bool_))


def register_markers(
    surface: FaceSurface, observations: Observations
) -> tuple[RegisteredMarkers, NameCheck]:
    """Register markers to a face, from the places of their names where they tell any.

    Without such names by a search from all poses (`usdface.binding.pose_search`).
    """
    count = len(observations.neutral)
    nothing = NameCheck(np.zeros(count, dtype=bool), used=False)
    if observations.named is None:
        return search_pose(surface, observations), nothing
    priors, exchanged = _sided(observations, _anchored(surface, observations))
    pose = named_pose(observations.neutral, priors)
    if (pose.squared < _WITHIN).mean() < _AGREEING:
        anonymous = replace(observations, named=None, heights=np.full(count, np.nan))
        registered = search_pose(surface, anonymous)
        return registered, replace(nothing, contradicted=_contradicted(registered, priors))
    contradicted = np.zeros(count, dtype=bool)
    for _ in range(_ROUNDS):
        told = replace(observations, named=priors.without(contradicted))
        pose = named_pose(told.neutral, priors.without(contradicted))
        registered = register_from(surface, told, pose.linear, pose.offset)
        now = _contradicted(registered, priors) & ~observations.anchored
        if not (now & ~contradicted).any() or (priors.known & ~now).sum() < FEWEST_NAMED:
            break
        contradicted |= now
    asked = exchanged and not observations.anchored.any()
    sided = (priors.sides != 0) & asked
    return registered, NameCheck(contradicted | sided, exchanged=asked)


def _anchored(surface: FaceSurface, observations: Observations) -> NamePriors:
    """Return the priors, at the given vertex for an anchored marker."""
    priors, fixed = observations.named, observations.anchored
    assert priors is not None
    points, spreads = np.array(priors.points), np.array(priors.spreads)
    points[fixed] = np.nan
    points[fixed, 0] = surface.points[observations.anchors[fixed]]
    spreads[fixed] = np.nanmin(spreads)
    return replace(priors, points=points, spreads=spreads)


def _sided(observations: Observations, priors: NamePriors) -> tuple[NamePriors, bool]:
    """Return the priors with the sides that fit the markers, and whether they are exchanged.

    Given vertices decide; else the pose that a face can have: its nose is in front.
    """
    fixed = observations.anchored & (priors.sides != 0)
    free = replace(priors, sides=np.where(observations.anchored, 0, priors.sides))
    mirrored = replace(free.mirrored(), sides=-priors.sides)
    if fixed.any():
        across = priors.points[fixed, 0, 0] - priors.middle
        exchanged = bool((across * priors.sides[fixed]).sum() < 0.0)
    else:
        usual, other = (
            named_pose(observations.neutral, each).squared.clip(max=_MOST).mean()
            for each in (priors, mirrored)
        )
        exchanged = bool(other < _EXCHANGED * usual)
    return (mirrored, True) if exchanged else (priors, False)


def _contradicted(registered: RegisteredMarkers, priors: NamePriors) -> BoolArray:
    """Return which markers lie elsewhere than their name tells, by the places of the others."""
    candidates = registered.candidates
    points, variance = predicted_by_others(candidates, registered.observations, registered.best)
    flat = (priors.points - (points + candidates.centre)[:, None])[..., :2]
    away = np.nan_to_num(np.linalg.norm(flat, axis=2), nan=np.inf).min(axis=1)
    limit = _CONTRADICTED * np.sqrt(priors.spreads**2 + variance)
    return np.asarray(priors.known & (away > limit))
