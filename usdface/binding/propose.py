"""Proposed bindings: a vertex for each marker of a take, with its confidence."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from usdface.advice import advice
from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.binding.anchor_check import DoubtedAnchor, check_anchors, without_anchors
from usdface.binding.confidence import placement_confidence
from usdface.binding.distinct_markers import distinct_markers
from usdface.binding.explaining_neutral import explaining_neutral
from usdface.binding.face_surface import FaceSurface, face_surface
from usdface.binding.held_poses import held_poses
from usdface.binding.landmarks import find_landmarks
from usdface.binding.lifted_take import lifted_take
from usdface.binding.name_priors import name_priors, named_heights
from usdface.binding.named_search import NameCheck, register_markers
from usdface.binding.neutral_frames import check_frames, distant_frames
from usdface.binding.observations import observe
from usdface.binding.peak_motion import targets_of
from usdface.binding.pose_search import RegisteredMarkers
from usdface.binding.proposal import ContradictedName, Proposal
from usdface.binding.registration import squared_errors, total_errors
from usdface.binding.stabilised_take import StabilisedTake, stabilised_markers
from usdface.errors import InputError
from usdface.face.bound_face import BoundFace
from usdface.face.marker_name_places import named_places
from usdface.face.place_descriptions import place_descriptions
from usdface.findings import Finding
from usdface.rigs import Mesh
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake

__all__ = ["propose"]

# A marker this far off the surface is not on the face [share of the face's size; ICT: 17 mm]: some
# four times the expected error, `registration.SHAPE_ERROR`.
_OFF_FACE = 0.25
# Vertices that are more likely wrong than right are not bound.
_UNSURE = 0.5
# Upper bound of squared errors, for the assignment of one vertex each.
_LARGEST_ERROR = 1e6


def propose(
    take: MarkerTake, mesh: Mesh, setup: RetargetSetup, *, find_neutral: bool = False
) -> Proposal:
    """Propose the vertex of each marker that has none.

    Parameters
    ----------
    take : MarkerTake
        In space, or of an image with names that tell places.
    mesh : Mesh
    setup : RetargetSetup
        Its binding is kept, and helps to place the other markers; it names neutral frames, and
        peak frames if they are not to be detected.
    find_neutral : bool
        Look for neutral frames instead: a pose that the face holds and from which the rig
        explains the peak frames.

    Raises
    ------
    InputError
        If the take is of an image without such names or shows too few markers, a neutral or peak
        frame that is named is not there, or the blend shapes of the mesh move no visible surface,
        or one of fewer vertices than there are markers.
    """
    given = {n: int(v) for n, v in zip(setup.binding.markers, setup.binding.points, strict=True)}
    surface = face_surface(mesh)
    placeless: tuple[str, ...] = ()
    if take.dimension == 2:
        whole = take
        take = lifted_take(whole, surface, _given_places(whole.names, given, mesh))
        placeless = tuple(name for name in whole.names if name not in take.names)
    used, duplicates = distinct_markers(take, given)
    if len(surface.vertices) < len(used):
        raise InputError(
            f"the blend shapes of mesh {mesh.name!r} move a visible surface of only "
            f"{len(surface.vertices)} vertices for {len(used)} markers; name the mesh of the face "
            'as "mesh" in --bind bind.json',
            "SKIN_MISSING",
        )
    names = tuple(take.names[i] for i in used)
    found = _registered(take, used, surface, setup, _anchors(names, given, surface), find_neutral)
    chosen = _one_vertex_each(found.markers)
    confidence, failed = _confidence(found, chosen)
    check, off = found.check, _off_face(found.markers)
    new = np.array([i for i, n in enumerate(names) if n not in given and not off[i]], dtype=int)
    bound, unsure = new[~(confidence[new] < _UNSURE)], new[confidence[new] < _UNSURE]
    wrong = tuple((names[anchor.marker], anchor) for anchor in found.doubted)
    doubted = {name for name, _ in wrong}
    vertices = surface.vertices[chosen]
    binding = Binding(
        (*given, *(names[i] for i in bound)),
        np.array([*given.values(), *vertices[bound]], dtype=np.int64),
        setup.binding.mesh,
        np.array([*(0.0 if name in doubted else 1.0 for name in given), *confidence[bound]]),
    )
    left_out = Binding(
        tuple(names[i] for i in unsure), vertices[unsure], setup.binding.mesh, confidence[unsure]
    )
    neutral = found.neutral if find_neutral else setup.neutral
    peaks = tuple(found.peaks.tolist())
    return Proposal(
        setup=replace(setup, binding=binding, unsure=left_out, neutral=neutral, peaks=peaks),
        placed=tuple(names[i] for i in new),
        never_seen=tuple(take.names[i] for i in np.flatnonzero(~take.visible.any(axis=0))),
        duplicates=duplicates,
        doubted=wrong,
        off_face=tuple(names[i] for i in np.flatnonzero(off)),
        contradicted=_contradicted_names(mesh, names, vertices, check.contradicted),
        exchanged=tuple(names[i] for i in np.flatnonzero(check.exchanged)),
        names_unused=found.named and not check.used,
        placeless=placeless,
        failed=tuple(failed),
    )


@dataclass(frozen=True, eq=False, slots=True)
class _Registered:
    """Markers on a face: how their names agree, the anchors that do not fit, and the frames."""

    markers: RegisteredMarkers
    check: NameCheck
    named: bool
    doubted: tuple[DoubtedAnchor, ...]
    neutral: tuple[int, int]
    peaks: IntArray


def _registered(
    take: MarkerTake,
    used: IntArray,
    surface: FaceSurface,
    setup: RetargetSetup,
    anchors: IntArray,
    find_neutral: bool,
) -> _Registered:
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
    return _Registered(registered, check, named, doubted, neutral, peaks)


def _confidence(found: _Registered, chosen: IntArray) -> tuple[FloatArray, list[Finding]]:
    """Return the confidence (M,) of chosen vertices, 0 where names say another; NaN = unknown."""
    confidence, failed = advice(
        "confidence of the proposed vertices",
        lambda: np.round(placement_confidence(found.markers, chosen), 3),
        np.full(len(chosen), np.nan),
    )
    doubtful = found.check.contradicted | found.check.exchanged
    return np.where(doubtful, np.minimum(confidence, 0.0), confidence), failed


def _given_places(names: Sequence[str], given: dict[str, int], mesh: Mesh) -> FloatArray:
    """Return the places of given vertices: (M, 3) [m], NaN for markers without one."""
    nowhere = np.full(3, np.nan)
    return np.array([mesh.points[given[name]] if name in given else nowhere for name in names])


def _contradicted_names(
    mesh: Mesh, names: Sequence[str], vertices: IntArray, contradicted: BoolArray
) -> tuple[ContradictedName, ...]:
    """Describe the places of some markers by name, and by registration."""
    some = np.flatnonzero(contradicted)
    unmarked = BoundFace(mesh, (), np.zeros(0, dtype=np.int64))
    named = named_places(names)
    return tuple(
        ContradictedName(names[i], place.description if (place := named[i]) else "", found)
        for i, found in zip(
            some.tolist(), place_descriptions(unmarked, vertices[some]), strict=True
        )
    )


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
