"""Closes the character's eyes in blinks and where they stay shut, and parts lids that cross."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.closure.blink_gaze import without_glances
from usdface.closure.closing_displacements import scanned_lid_displacements
from usdface.closure.closings import find_closings
from usdface.closure.even_times import even_times
from usdface.closure.eye_closing import EyeClosing, closing_course, nearest_frame
from usdface.closure.lid_apertures import EYES, Eye, LidApertures
from usdface.closure.lid_contact import close_lids
from usdface.closure.lid_estimate import lid_estimate
from usdface.closure.lid_motion import lid_markers, lid_motion
from usdface.closure.lid_signal import least_pulses, lid_signal
from usdface.closure.parted_lids import one_shape_for_both, part_eyes
from usdface.closure.recorded_blinks import recorded_blinks, unseen_blinks
from usdface.closure.solved_lids import solved_lids
from usdface.closure.solved_performance import SolvedPerformance
from usdface.closure.unshown_closing import (
    opened_findings,
    shown_closing,
    without_unshown_closing,
)
from usdface.face.bound_face import BoundFace
from usdface.face.expression_poses import units_of
from usdface.findings import Finding, finding

__all__ = ["ClosedEyes", "CompletedClosing", "close_eyes", "lids_not_found"]

_EYES_CLOSED = 43  # the action unit of FACS


@dataclass(frozen=True, slots=True)
class CompletedClosing:
    """An eye closing, and how the character shows it.

    Attributes
    ----------
    closing : EyeClosing
    frames : (int, int)
        First and last frame index that it changes.
    peak : int
        Frame index at which it is closed.
    before, after : tuple of float, one for each eye
        Weight of the blend shape that closes the eye, at the peak.
    apertures : tuple of float, one for each eye [m]
        Remaining aperture at the widest place, at the peak.
    """

    closing: EyeClosing
    frames: tuple[int, int]
    peak: int
    before: tuple[float, ...]
    after: tuple[float, ...]
    apertures: tuple[float, ...]


@dataclass(frozen=True, eq=False, slots=True)
class ClosedEyes:
    """Weights (F, T), the course (F, 2) of the two eyes, their closings, and findings."""

    weights: FloatArray
    course: FloatArray
    closings: tuple[CompletedClosing, ...]
    findings: list[Finding]


def close_eyes(
    performance: SolvedPerformance,
    weights: FloatArray,
    by_eye: Mapping[Eye, LidApertures],
    blink: FloatArray | None = None,
) -> ClosedEyes | None:
    """Complete the blinks of a take, and part lids that cross.

    Parameters
    ----------
    performance : SolvedPerformance
    weights : (F, T) float64
        The weights to close, corrected or not.
    by_eye : mapping of "left", "right" to LidApertures
        Of the T blend shapes.
    blink : (F,) float64, optional
        `usdface.takes.MarkerTake.blink`: blinks that the markers do not show are closed, too.

    Returns
    -------
    ClosedEyes or None
        None of a face without lids.
    """
    if not by_eye:
        return None
    face, performed, solution = performance.face, performance.performed, performance.solution
    names, times, near_pins = performed.names, performed.times, performance.near_pins
    signal = lid_signal(face, by_eye, performed, solution)
    markers = lid_markers(face, by_eye, names, solution) if solution else []
    by_itself = lid_motion(markers, solution) if solution else None
    estimate = lid_estimate(face, by_eye, names, solution) if solution else None
    closings, left_open = find_closings(
        times,
        signal,
        by_itself=by_itself,
        least=least_pulses(face, by_eye, names, solution) if solution else None,
        gone=estimate.gone if estimate else None,
        deviation=estimate.deviation if estimate else None,
        solved=solved_lids(face, by_eye, performed) if solution else None,
    )
    recorded = [] if blink is None else recorded_blinks(times, blink)
    unseen = unseen_blinks(recorded, closings)
    closings = sorted([*closings, *unseen], key=lambda each: each.closed)
    findings = _unseen(by_eye, signal)
    findings += _left_open(_apart_from(unseen, left_open, times))
    course = _eye_course(closing_course(times, closings), by_eye, near_pins)
    if solution:
        findings += _by_another_face(face, by_eye, names)
    closed = weights
    if solution:  # lids and gaze of a take of weights are measured, not solved from markers
        shown = shown_closing(signal, by_itself, even_times(times))
        closed = without_unshown_closing(
            weights,
            performed.weights,
            shown,
            by_eye,
            near_pins,
            exaggerated=performance.solved.weights,
        )
        findings += opened_findings(weights, closed, by_eye)
        closed = without_glances(closed, times, names, closings, near_pins)
    for eye, apertures in by_eye.items():
        closed = close_lids(closed, course[:, EYES.index(eye)], apertures)
    closed, new_findings = part_eyes(closed, by_eye, near_pins, times)
    findings += new_findings
    every = (_completed(each, by_eye, times, weights, closed) for each in closings)
    # One shape that closes both eyes does not wink, and pins hold weights.
    completed = tuple(each for each in every if _changed(each, by_eye, weights, closed))
    findings += _by_recorder(each for each in completed if each.closing in unseen)
    return ClosedEyes(closed, course, completed, findings + _closed(completed))


def lids_not_found(face: BoundFace, names: tuple[str, ...]) -> list[Finding]:
    """Report blend shapes that close the eyes by name, of a face on which no lids were found.

    Parameters
    ----------
    face : BoundFace
    names : tuple of str
        Blend shapes of the rig.
    """
    closers = [name for name, units in units_of(names).items() if _EYES_CLOSED in units]
    if not closers or len(face.with_contacts().layout.lids):
        return []
    message = (
        "on the mesh no two rims of lids were found that a blend shape brings together, so "
        "blinks are not completed; by their names these close the eyes: {shapes}"
    )
    return [finding("LIDS_NOT_FOUND", "lids", message, closers)]


def _eye_course(
    course: FloatArray, by_eye: Mapping[Eye, LidApertures], near_pins: FloatArray
) -> FloatArray:
    """Return the course (F, 2) of the eyes that can close, faded out near pins of their shapes."""
    result = np.zeros(course.shape)
    for eye, apertures in by_eye.items():
        column = EYES.index(eye)
        shapes = [apertures.closer, *apertures.tighteners, *apertures.raisers]
        result[:, column] = course[:, column] * (1.0 - near_pins[:, shapes].max(axis=1))
    if one_shape_for_both(by_eye):  # not for a wink
        result[:] = result.min(axis=1, keepdims=True)
    return result


def _unseen(by_eye: Mapping[Eye, LidApertures], signal: FloatArray) -> list[Finding]:
    message = "no marker moves with its lids, so markers do not show its blinks"
    return [
        finding("LIDS_UNSEEN", f"{eye} eye", message)
        for eye in by_eye
        if np.isnan(signal[:, EYES.index(eye)]).all()
    ]


def _left_open(peaks: IntArray) -> list[Finding]:
    if not len(peaks):
        return []
    message = (
        "{pulse_count} blink-like pulses were left as solved, closing the eyes by too "
        "little for blinks: at frames {frames}"
    )
    return [finding("BLINK_DOUBTED", "lids", message, len(peaks), peaks.tolist())]


def _apart_from(closings: Sequence[EyeClosing], peaks: IntArray, times: FloatArray) -> IntArray:
    """Return the peaks (N,) that are in no closing."""
    at = times[peaks]
    inside = [(each.start <= at) & (at <= each.end) for each in closings]
    return np.asarray(peaks[~np.any(inside, axis=0)] if inside else peaks)


def _by_recorder(blinks: Iterable[CompletedClosing]) -> list[Finding]:
    frames = [each.peak for each in blinks]
    if not frames:
        return []
    message = (
        "the markers do not show {blink_count} blinks, which the recording names, at frames "
        "{frames}; they are closed"
    )
    return [finding("BLINK_RECORDED", "lids", message, len(frames), frames)]


def _by_another_face(
    face: BoundFace, by_eye: Mapping[Eye, LidApertures], names: tuple[str, ...]
) -> list[Finding]:
    message = (
        "its lids move the markers unlike a person's, so blinks are sought as people show them"
    )
    return [
        finding("LIDS_GUESSED", f"{eye} eye", message)
        for eye, apertures in by_eye.items()
        if scanned_lid_displacements(face, apertures, names)
    ]


def _completed(
    closing: EyeClosing,
    by_eye: Mapping[Eye, LidApertures],
    times: FloatArray,
    before: FloatArray,
    after: FloatArray,
) -> CompletedClosing:
    first = int(np.searchsorted(times, closing.start, "right"))
    last = int(np.searchsorted(times, closing.end)) - 1
    peak = nearest_frame(times, closing.closed)
    own = [by_eye[EYES[eye]] for eye in closing.eyes if EYES[eye] in by_eye]
    return CompletedClosing(
        closing,
        (first, last) if first <= last else (peak, peak),
        peak,
        tuple(float(before[peak, eye.closer]) for eye in own),
        tuple(float(after[peak, eye.closer]) for eye in own),
        tuple(float(eye.ends(after[peak : peak + 1])[1][0]) for eye in own),
    )


def _changed(
    completed: CompletedClosing,
    by_eye: Mapping[Eye, LidApertures],
    before: FloatArray,
    after: FloatArray,
) -> bool:
    """Whether weights that move the lids changed in the frames of a closing."""
    first, last = completed.frames
    changed = (before[first : last + 1] != after[first : last + 1]).any(axis=0)
    own = [by_eye[EYES[eye]] for eye in completed.closing.eyes if EYES[eye] in by_eye]
    return any(changed[each.movers].any() or changed[[*each.raisers]].any() for each in own)


def _closed(completed: Sequence[CompletedClosing]) -> list[Finding]:
    findings = []
    for kind, words in (("blink", "blinks were completed"), ("held", "eyes that stay shut closed")):
        own = [each for each in completed if each.closing.kind == kind]
        if own:
            message = f"{{closing_count}} {words}, at frames {{frames}}"
            frames = sorted({each.peak for each in own})  # of both eyes, which may be closings each
            findings.append(finding("EYES_CLOSED", "lids", message, len(own), frames, kind=kind))
    guessed = [each.peak for each in completed if each.closing.guessed]
    if guessed:
        message = (
            f"only one eye was seen to blink at frame{'s' if len(guessed) > 1 else ''} "
            "{frames}; both are closed, as a blink that fast is of both"
        )
        findings.append(finding("BLINK_GUESSED", "lids", message, guessed))
    return findings
