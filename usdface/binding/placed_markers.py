"""Markers on a face: registered, and each with a vertex of its own and its confidence."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from usdface.advice import advice
from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.binding.anchor_check import DoubtedAnchor, check_anchors, without_anchors
from usdface.binding.confidence import placement_confidence
from usdface.binding.distinct_markers import FEWEST
from usdface.binding.explaining_neutral import explaining_neutral
from usdface.binding.face_surface import FaceSurface
from usdface.binding.held_poses import held_poses
from usdface.binding.landmarks import find_landmarks
from usdface.binding.name_priors import name_priors, named_heights
from usdface.binding.named_search import NameCheck, register_markers
from usdface.binding.neutral_frames import check_frames, distant_frames
from usdface.binding.observations import observe
from usdface.binding.peak_motion import targets_of
from usdface.binding.pose_search import RegisteredMarkers
from usdface.binding.registration import squared_errors, total_errors
from usdface.binding.stabilised_take import StabilisedTake, stabilised_markers
from usdface.errors import InputError
from usdface.findings import Finding
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake

__all__ = ["FoundPlaces", "RegisteredTake", "place_markers"]

# A marker this far off the surface is not on the face [share of the face's size; ICT: 17 mm]: some
# four times the expected error, `registration.SHAPE_ERROR`.
_OFF_FACE = 0.25
# Vertices that are more likely wrong than right are not bound.
_UNSURE = 0.5
# Times at most that markers are placed again without those off the face.
_AGAIN = 3
# Upper bound of squared errors, for the assignment of one vertex each.
_LARGEST_ERROR = 1e6


@dataclass(frozen=True, eq=False, slots=True)
class RegisteredTake:
    """A take whose markers have places on a face: agreement of names, doubted anchors, frames.

    Attributes
    ----------
    markers : RegisteredMarkers
    check : NameCheck
    named : bool
        Some names have known places, though they may not be used.
    doubted : tuple of DoubtedAnchor
        Anchors that the registration does not use.
    neutral : (int, int)
        First and last neutral frame.
    peaks : (K,) int64
        Peak frames.
    """

    markers: RegisteredMarkers
    check: NameCheck
    named: bool
    doubted: tuple[DoubtedAnchor, ...]
    neutral: tuple[int, int]
    peaks: IntArray


@dataclass(frozen=True, eq=False, slots=True)
class FoundPlaces:
    """Markers on a face.

    Attributes
    ----------
    used : (M,) int64
        Their indices in the take.
    found : RegisteredTake
    chosen : (M,) int64
        Indices into the surface's vertices, no two markers on one.
    confidence : (M,) float64
        Of these; NaN = unknown.
    off : (M,) bool
        Not on the face.
    failed : tuple of Finding
        Where no confidence can be computed.
    """

    used: IntArray
    found: RegisteredTake
    chosen: IntArray
    confidence: FloatArray
    off: BoolArray
    failed: tuple[Finding, ...]

    @property
    def unsure(self) -> BoolArray:
        """(M,) bool: their vertices are more likely wrong than right."""
        return np.asarray(self.confidence < _UNSURE)


def place_markers(
    take: MarkerTake,
    used: IntArray,
    surface: FaceSurface,
    setup: RetargetSetup,
    given: dict[str, int],
    *,
    find_neutral: bool,
) -> tuple[FoundPlaces, dict[str, DoubtedAnchor | None]]:
    """Place the markers `used` of a take, of which some have a `given` vertex.

    Where some are off the face, as reflections and those of bodies and props, and others unsure,
    these are placed again without them: the misfit of each counts for all.

    Parameters
    ----------
    take : MarkerTake
        In space.
    used : (M,) int64
        Indices of visible markers, none a copy of another.
    surface : FaceSurface
    setup : RetargetSetup
        Its neutral and peak frames.
    given : dict of str to int
        Vertices of the mesh by marker.
    find_neutral : bool
        As of `propose`.

    Returns
    -------
    FoundPlaces
    dict of str to DoubtedAnchor or None
        The markers that were left out for that, by name; the doubt of a given vertex, if there is
        one. Indices in it are those of the placing that found it.

    Raises
    ------
    InputError
        If the markers do not move, or a neutral or peak frame that is named is not there.
    """
    placed = _placed(take, used, surface, setup, given, find_neutral)
    strays: dict[str, DoubtedAnchor | None] = {}
    for _ in range(_AGAIN):
        on = placed.used[~placed.off]
        if not (placed.off.any() and placed.unsure[~placed.off].any() and len(on) >= FEWEST):
            break
        doubts = {anchor.marker: anchor for anchor in placed.found.doubted}
        off = np.flatnonzero(placed.off).tolist()
        strays |= {take.names[placed.used[m]]: doubts.get(m) for m in off}
        placed = _placed(take, on, surface, setup, given, find_neutral)
    return placed, strays


def _placed(
    take: MarkerTake,
    used: IntArray,
    surface: FaceSurface,
    setup: RetargetSetup,
    given: dict[str, int],
    find_neutral: bool,
) -> FoundPlaces:
    anchors = _anchors(tuple(take.names[i] for i in used), given, surface)
    found = _registered(take, used, surface, setup, anchors, find_neutral)
    chosen = _one_vertex_each(found.markers)
    confidence, failed = _confidence(found, chosen)
    off = _off_face(found.markers)
    return FoundPlaces(used, found, chosen, confidence, off, tuple(failed))


def _registered(
    take: MarkerTake,
    used: IntArray,
    surface: FaceSurface,
    setup: RetargetSetup,
    anchors: IntArray,
    find_neutral: bool,
) -> RegisteredTake:
    """Register the markers `used` (M,) of a take, with those anchors (M,) that fit the others."""
    names = tuple(take.names[i] for i in used)
    stabilised = stabilised_markers(take, used, "the vertices of markers cannot be proposed")
    held = held_poses(stabilised, take.times)
    likely = held[0].frames
    neutral = likely if find_neutral else setup.neutral or likely
    check_frames(take, neutral, setup.peaks)
    peaks = _peaks(take, stabilised, neutral, named=setup.peaks)
    landmarks = find_landmarks(surface)
    observations = observe(
        stabilised.positions,
        neutral,
        peaks,
        anchors=anchors,
        heights=named_heights(names),
        named=name_priors(names, landmarks) if landmarks else None,
    )
    registered, check = register_markers(surface, observations)
    doubted = check_anchors(registered) if observations.anchored.any() else ()
    if doubted:
        observations = without_anchors(observations, [anchor.marker for anchor in doubted])
        registered, check = register_markers(surface, observations)
    if find_neutral:
        neutral = explaining_neutral(
            held,
            [observations.again(stabilised.positions, pose.frames, peaks) for pose in held],
            targets_of(registered.candidates, registered.best),
            start=registered.best,
            size=registered.candidates.size,
        )
        if neutral != likely:
            peaks = _peaks(take, stabilised, neutral, named=setup.peaks)
            observations = observations.again(stabilised.positions, neutral, peaks)
            registered, check = register_markers(surface, observations)
    named = observations.named is not None
    return RegisteredTake(registered, check, named, doubted, neutral, peaks)


def _confidence(found: RegisteredTake, chosen: IntArray) -> tuple[FloatArray, list[Finding]]:
    """Return the confidence (M,) of chosen vertices, 0 where names say another; NaN = unknown."""
    confidence, failed = advice(
        "confidence of the proposed vertices",
        lambda: np.round(placement_confidence(found.markers, chosen), 3),
        np.full(len(chosen), np.nan),
    )
    doubtful = found.check.contradicted | found.check.exchanged
    return np.where(doubtful, np.minimum(confidence, 0.0), confidence), failed


def _peaks(
    take: MarkerTake,
    stabilised: StabilisedTake,
    neutral: tuple[int, int],
    *,
    named: Sequence[int],
) -> IntArray:
    peaks = distant_frames(stabilised, neutral)
    if not len(peaks):
        raise InputError(
            f"the face in the take {take.source} does not move; the vertices of its markers cannot "
            "be proposed. Take one with expressions, or give --bind bind.json",
            "TAKE_STILL",
        )
    return np.array(named) if named else peaks


def _anchors(names: Sequence[str], given: dict[str, int], surface: FaceSurface) -> IntArray:
    """Return the given vertices as indices into the surface; -1 for a marker without one."""
    anchors = np.full(len(names), -1)
    for i, name in enumerate(names):
        if name in given:
            where = int(np.searchsorted(surface.vertices, given[name]))
            if where < len(surface.vertices) and surface.vertices[where] == given[name]:
                anchors[i] = where
    return anchors


def _one_vertex_each(registered: RegisteredMarkers) -> IntArray:
    """Return (M,) indices into the surface's vertices, no two markers on one."""
    candidates, best = registered.candidates, registered.best
    if len(np.unique(best.assigned)) == len(best.assigned):
        return np.asarray(candidates.indices[best.assigned])
    total = total_errors(candidates, registered.observations, best).clip(max=_LARGEST_ERROR)
    fixed = registered.observations.anchored
    total[fixed, registered.observations.anchors[fixed]] = -_LARGEST_ERROR
    _, chosen = linear_sum_assignment(total)
    return np.asarray(candidates.indices[chosen])


def _off_face(registered: RegisteredMarkers) -> BoolArray:
    """Return which markers are off the face and not anchored: (M,) bool."""
    place, _ = squared_errors(
        registered.candidates, registered.observations, registered.best, shape_error=_OFF_FACE
    )
    off: BoolArray = (place.min(axis=1) > 1.0) & ~registered.observations.anchored
    return off
