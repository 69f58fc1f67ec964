"""A binding proposed: which vertex each marker of a take sits on, and how sure that is."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from usdface.advice import advice
from usdface.binding.confidence import confidence
from usdface.binding.domain import Domain
from usdface.binding.evidence import Evidence
from usdface.binding.given import doubted
from usdface.binding.names import named_heights
from usdface.binding.register import Registration, closeness, unexplained_motion
from usdface.binding.rest import (
    Performance,
    peak_frames,
    rest_frames,
    resting_poses,
    still_face,
)
from usdface.binding.search import search
from usdface.binding.skin import Skin, skin_of
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.rigs import Mesh
from usdface.setup import Binding, Setup
from usdface.takes import BoolArray, FloatArray, IntArray, MarkerTake

__all__ = ["check_frames", "neutral_frames", "propose", "strong_frames"]

# Fewer markers fit any face anyhow; three that are given hold it.
_FEWEST, _FEWEST_ANCHORED = 8, 4
_PEAKS = 24
# Of so many poses that the face holds the one is neutral that leaves clearly less unexplained
# than the most usual one.
_RESTS, _CLEARLY = 8, 0.8
# A marker this far off the skin is not on the face [share of the face's size; ICT: 17 mm].
_OFF = 0.25
# Markers that stay this near to each other are one [share of their spread].
_TWINS = 0.01
# What is less sure is named, one by one; where half are, the answer as a whole.
_UNSURE = 0.5


def neutral_frames(take: MarkerTake) -> tuple[int, int]:
    """Return the first and last frame index of the pose that the face rests in.

    Raises
    ------
    InputError
        If the take is two-dimensional, or has too few markers to hold the head still.
    """
    return rest_frames(_performance(take, "neutral"), take.times)


def strong_frames(take: MarkerTake, neutral: tuple[int, int]) -> tuple[int, ...]:
    """Return the frame indices of expressions far from neutral and from each other, most first.

    Raises
    ------
    InputError
        As `neutral_frames`.
    """
    return tuple(peak_frames(_performance(take, "peak"), neutral, _PEAKS).tolist())


def propose(
    take: MarkerTake, mesh: Mesh, setup: Setup, find_neutral: bool = False
) -> tuple[Setup, list[Finding]]:
    """Propose where the markers of a take sit on a face.

    Parameters
    ----------
    take : MarkerTake
        In space.
    mesh : Mesh
    setup : Setup
        Its binding is kept, and helps to place the other markers; it names neutral frames, and
        peak frames if they are not to be looked for.
    find_neutral : bool
        Look for neutral frames instead: a pose that the face holds and from which the rig
        explains the peak frames.

    Returns
    -------
    Setup
        The given one with the proposed places, their confidence, neutral and peak frames.
    list of Finding

    Raises
    ------
    InputError
        If the take is two-dimensional or shows too few markers, a neutral or peak frame that is
        named is not there, or the mesh has no skin.
    """
    given = {n: int(v) for n, v in zip(setup.binding.markers, setup.binding.points, strict=True)}
    skin = skin_of(mesh)
    used, findings = _usable(take, given)
    names = tuple(take.names[i] for i in used)
    performance = still_face(_in_space(take)[:, used])
    resting = resting_poses(performance, take.times, _RESTS)
    neutral = resting[0] if find_neutral else setup.neutral or resting[0]
    check_frames(take, neutral, setup.peaks)
    peaks = peak_frames(performance, neutral, _PEAKS)
    if not len(peaks):
        raise InputError(
            f"the face in the take {take.source} does not move; where its markers sit cannot be "
            "proposed. Take one with expressions, or give --bind bind.json",
            "TAKE_STILL",
        )
    if setup.peaks:
        peaks = np.array(setup.peaks)
    anchors, heights = _anchors(names, given, skin), named_heights(names)
    evidence = _evidence(performance.still, neutral, peaks, anchors, heights)
    evidence, domain, answers, wrong = _searched(skin, names, evidence)
    anchors = evidence.anchors
    findings += wrong
    if find_neutral:
        others = [_evidence(performance.still, r, peaks, anchors, heights) for r in resting]
        left = np.array([unexplained_motion(domain, other, answers[0]) for other in others])
        if left.min() < _CLEARLY * left[0]:
            neutral = resting[int(left.argmin())]
        setup = replace(setup, neutral=neutral)
    places = _one_each(domain, evidence, answers[0])
    sure, failed = advice(
        "confidence of the proposed places",
        lambda: np.round(confidence(skin, domain, evidence, answers, places), 3),
        np.full(len(places), np.nan),
    )
    findings += failed
    off = _off_the_face(domain, evidence, answers[0])
    findings += [
        finding("MARKER_OFF_FACE", names[i], "it lies off the face and is left out")
        for i in np.flatnonzero(off)
    ]
    new = [i for i, name in enumerate(names) if name not in given and not off[i]]
    points = skin.vertices[places[new]]
    findings += _doubts(take, [names[i] for i in new], points, sure[new])
    doubtful = {f.where for f in wrong}
    binding = Binding(
        (*given, *(names[i] for i in new)),
        np.array([*given.values(), *points], dtype=np.int64),
        setup.binding.mesh,
        np.array([*(0.0 if n in doubtful else 1.0 for n in given), *sure[new]]),
    )
    return replace(setup, binding=binding, peaks=tuple(peaks.tolist())), findings


def _performance(take: MarkerTake, kind: str) -> Performance:
    positions = _in_space(take)
    if take.visible.sum(axis=1).max() < _FEWEST_ANCHORED:
        raise InputError(
            f"no frame of the take {take.source} shows {_FEWEST_ANCHORED} markers; "
            f"{kind} frames cannot be found",
            "MARKERS_TOO_FEW",
        )
    return still_face(positions[:, take.visible.any(axis=0)])


def check_frames(take: MarkerTake, neutral: tuple[int, int] | None, peaks: Sequence[int]) -> None:
    """Raise an `InputError` that names a neutral or peak frame that the take does not have."""
    there = f"the take {take.source}, which has frames 0 to {len(take.times) - 1}"
    if neutral and neutral[1] >= len(take.times):
        raise InputError(
            f"neutral frames {neutral[0]} to {neutral[1]} lie outside {there}", "FRAMES_OUTSIDE"
        )
    if max(peaks, default=0) >= len(take.times):
        raise InputError(f"the peak frame {max(peaks)} lies outside {there}", "FRAMES_OUTSIDE")


def _searched(
    skin: Skin, names: Sequence[str], evidence: Evidence
) -> tuple[Evidence, Domain, tuple[Registration, ...], list[Finding]]:
    """Register the markers, given places that do not fit left out of the evidence and named."""
    domain, answers = search(skin, evidence)
    if not (evidence.anchors >= 0).any():
        return evidence, domain, answers, []
    doubt, likely = doubted(skin, domain, evidence, answers[0])
    if not doubt.any():
        return evidence, domain, answers, []
    found = []
    for i in np.flatnonzero(doubt).tolist():
        at, other = skin.vertices[[evidence.anchors[i], likely[i]]]
        away = 1000.0 * float(skin.reach(np.array([at]))[0, likely[i]])
        message = (
            f"given at vertex {at}, but it fits vertex {other}, {away:.0f} mm away along the "
            "skin; kept there, and not used to place the others"
        )
        found.append(finding("PLACE_DOUBTED", names[i], message))
    evidence = replace(evidence, anchors=np.where(doubt, -1, evidence.anchors))
    return evidence, *search(skin, evidence), found


def _in_space(take: MarkerTake) -> FloatArray:
    if take.dimension != 3:
        raise InputError(
            f"the take {take.source} is of an image; where its markers sit cannot be proposed. "
            "Give all of them in --bind bind.json",
            "TAKE_KIND_WRONG",
        )
    return take.positions


def _usable(take: MarkerTake, given: dict[str, int]) -> tuple[IntArray, list[Finding]]:
    """Return the markers that are seen and are no copies; say why not the others."""
    positions, seen = _in_space(take), take.visible
    findings = [
        finding("MARKER_NEVER_SEEN", take.names[i]) for i in np.flatnonzero(~seen.any(axis=0))
    ]
    used = np.flatnonzero(seen.any(axis=0))
    anchored = len(given.keys() & {take.names[i] for i in used})
    least = _FEWEST_ANCHORED if anchored >= 3 else _FEWEST
    if len(used) < least:
        raise InputError(
            f"the take {take.source} shows {len(used)} markers; to propose where they sit takes "
            f"{_FEWEST}, or {_FEWEST_ANCHORED} of which three are in --bind bind.json",
            "MARKERS_TOO_FEW",
        )
    middle = np.nanmedian(positions[:, used], axis=0)
    size = np.sqrt(((middle - np.median(middle, axis=0)) ** 2).sum(axis=1).mean())
    copies: set[int] = set()
    near = np.linalg.norm(middle[:, None] - middle, axis=2) < _TWINS * size
    for a, b in np.argwhere(np.triu(near, 1)).tolist():
        apart = np.linalg.norm(positions[:, used[a]] - positions[:, used[b]], axis=1)
        if a not in copies and not (apart > _TWINS * size).any():
            copy, original = (a, b) if take.names[used[b]] in given else (b, a)
            copies.add(copy)
            message = f"always at the place of {take.names[used[original]]!r}; left out"
            findings.append(finding("MARKER_DUPLICATE", take.names[used[copy]], message))
    return np.delete(used, sorted(copies)), findings


def _anchors(names: Sequence[str], given: dict[str, int], skin: Skin) -> IntArray:
    """Return the given places as indices into the skin; -1 for a marker without one."""
    anchors = np.full(len(names), -1)
    for i, name in enumerate(names):
        if name in given:
            where = int(np.searchsorted(skin.vertices, given[name]))
            if where < len(skin.vertices) and skin.vertices[where] == given[name]:
                anchors[i] = where
    return anchors


def _evidence(
    still: FloatArray,
    neutral: tuple[int, int],
    peaks: IntArray,
    anchors: IntArray,
    heights: FloatArray,
) -> Evidence:
    window = still[neutral[0] : neutral[1] + 1]
    count = (~np.isnan(window[..., 0])).sum(axis=0)[:, None]
    rest = np.nansum(window, axis=0) / np.maximum(count, 1)
    # What neutral does not show is where it mostly is.
    rest = np.where(count > 0, rest, np.nanmedian(still, axis=0))
    moves = still[peaks] - rest
    return Evidence(rest, np.nan_to_num(moves), ~np.isnan(moves[..., 0]), anchors, heights)


def _one_each(domain: Domain, evidence: Evidence, answer: Registration) -> IntArray:
    """Return the places, no two markers on one vertex: (M,) indices into the skin."""
    if len(np.unique(answer.places)) == len(answer.places):
        return np.asarray(domain.places[answer.places])
    place, motion = closeness(domain, evidence, answer)
    total = np.minimum(place + motion, 1e6)
    fixed = evidence.anchors >= 0
    total[fixed, evidence.anchors[fixed]] = -1e6
    _, chosen = linear_sum_assignment(total)
    return np.asarray(domain.places[chosen])


def _off_the_face(domain: Domain, evidence: Evidence, answer: Registration) -> BoolArray:
    place, _ = closeness(domain, evidence, answer, shape_error=_OFF)
    off: BoolArray = (place.min(axis=1) > 1.0) & (evidence.anchors < 0)
    return off


def _doubts(
    take: MarkerTake, names: Sequence[str], points: IntArray, sure: FloatArray
) -> list[Finding]:
    doubtful = [
        finding("PLACE_UNSURE", name, f"vertex {vertex} may be wrong: confidence {share:.2f}")
        for name, vertex, share in zip(names, points, sure, strict=True)
        if share < _UNSURE
    ]
    message = f"the places of {len(names)} markers are proposed; look at them before use"
    found = [finding("BIND_PROPOSED", take.source, message), *doubtful]
    if 2 * len(doubtful) > len(names):
        message = (
            f"{len(doubtful)} of {len(names)} places are unsure: nothing fits these markers well; "
            "give a few of them in --bind bind.json, with --propose for the others"
        )
        found.append(finding("BIND_UNSURE", take.source, message))
    return found
