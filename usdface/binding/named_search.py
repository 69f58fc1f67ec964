"""Registration of named markers, initialised by the places of their names, which it then checks."""

from dataclasses import dataclass, replace

import numpy as np

from usdface.arrays import BoolArray, FloatArray, freeze
from usdface.binding.alignment import predicted_by_others
from usdface.binding.face_surface import FaceSurface
from usdface.binding.name_priors import FEWEST_NAMED, NamePriors, named_pose
from usdface.binding.observations import Observations
from usdface.binding.pose_search import RegisteredMarkers, register_from, search_pose

__all__ = ["NameCheck", "register_markers"]

# A name is contradicted where the marker lies so many standard deviations from its place, by the
# places of the others. Set by hand; judge: `python benchmarks/binding.py named`.
_CONTRADICTED = 4.0
# Names are used where this share of them lies within three deviations of one pose.
_AGREEING, _WITHIN = 0.6, 9.0
# Left and right are exchanged where that leaves less than this share of the error. Three heads with
# three takes: 0.14 to 0.64 of the error if they are, 1.6 to 7 times if not.
_EXCHANGED = 0.8
# Errors are clipped at this square: a few wrong names do not decide for all.
_MOST = 25.0
# Rounds of registering and of leaving out contradicted names.
_ROUNDS = 3


@dataclass(frozen=True, eq=False, slots=True)
class NameCheck:
    """Contradictions between the names of M markers and where they lie.

    Attributes
    ----------
    contradicted : (M,) bool
        Markers that lie elsewhere than their names say.
    exchanged : (M,) bool
        Markers named for the opposite side, where all names are and no given vertex confirms it.
    used : bool
        False where the names as a whole fit no face, or are unknown: places were found without
        them.
    """

    contradicted: BoolArray
    exchanged: BoolArray
    used: bool = True

    def __post_init__(self) -> None:
        freeze(self, "contradicted", "exchanged", dtype=np.bool_)


def register_markers(
    surface: FaceSurface, observations: Observations
) -> tuple[RegisteredMarkers, NameCheck]:
    """Register markers to a face, from the places of their names where these are known.

    Without such names by a search from all poses (`usdface.binding.pose_search`).
    """
    none = np.zeros(len(observations.neutral), dtype=bool)
    if observations.named is None:
        return search_pose(surface, observations), NameCheck(none, none, used=False)
    fixed = observations.anchored
    at = surface.points[observations.anchors]
    priors, exchanged = _sided(observations.neutral, observations.named.at(fixed, at))
    if (named_pose(observations.neutral, priors).squared < _WITHIN).mean() < _AGREEING:
        heights = np.full(len(none), np.nan)
        registered = search_pose(surface, replace(observations, named=None, heights=heights))
        found = _contradicted(registered, observations.named) & ~fixed
        return registered, NameCheck(found, none, used=False)
    priors_used = observations.named.mirrored() if exchanged else observations.named
    contradicted = none
    for _ in range(_ROUNDS):
        some = replace(observations, named=priors_used.without(contradicted))
        pose = named_pose(observations.neutral, priors.without(contradicted))
        registered = register_from(surface, some, pose.linear, pose.offset)
        found = contradicted | (_contradicted(registered, priors_used) & ~fixed)
        if (found == contradicted).all() or (priors_used.known & ~found).sum() < FEWEST_NAMED:
            break
        contradicted = found
    sided = observations.named.sides != 0
    across = observations.named.sides * (at[:, 0] - observations.named.middle)
    uncertain = exchanged and not (fixed & (across < 0.0)).any()
    return registered, NameCheck(contradicted, sided & ~fixed & uncertain)


def _sided(neutral: FloatArray, priors: NamePriors) -> tuple[NamePriors, bool]:
    """Return the priors with the sides that fit the markers, and whether they are exchanged.

    A face is no mirror image of itself: its nose is in front.
    """
    mirrored = priors.mirrored()
    usual, other = (
        named_pose(neutral, each).squared.clip(max=_MOST).mean() for each in (priors, mirrored)
    )
    return (mirrored, True) if other < _EXCHANGED * usual else (priors, False)


def _contradicted(registered: RegisteredMarkers, priors: NamePriors) -> BoolArray:
    """Return which markers lie elsewhere than their names say, by the places of the others."""
    points, variance = predicted_by_others(
        registered.candidates, registered.observations, registered.best
    )
    away = (priors.points - (points + registered.candidates.centre)[:, None])[..., :2]
    nearest = np.nan_to_num(np.linalg.norm(away, axis=2), nan=np.inf).min(axis=1)
    limit = _CONTRADICTED * np.sqrt(priors.spreads**2 + variance)
    return np.asarray(priors.known & (nearest > limit))
