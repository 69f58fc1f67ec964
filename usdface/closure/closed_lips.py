"""Lips that touch on the performer, brought together on the character."""

from dataclasses import dataclass

import numpy as np

from usdface.arrays import FloatArray
from usdface.closure.lip_contact import as_open_as_seen, lip_apertures_of, touching_lips
from usdface.closure.lip_limits import largest_apertures
from usdface.closure.lip_signal import lip_distances
from usdface.closure.solved_performance import SolvedPerformance
from usdface.findings import Finding, finding

__all__ = ["ClosedLips", "close_lips"]

# Least movement that is reported [m].
_REPORTED = 1e-4
# Least tolerance of a contact [m]: a share of none is not defined.
_LEAST_TOLERANCE = 1e-5
_CLOSED = (
    "lips that touch on the performer were brought together in {frame_count} frames "
    "({first_frame} to {last_frame}), by {closed_mm:.1f} mm at most"
)
_APART = (
    "lips that touch on the performer stay open in {frame_count} frames ({first_frame} to "
    "{last_frame}), by {gap_mm:.1f} mm at most more than the markers allow: no weights were found "
    "that close them and leave the rest of the mouth as open as its markers"
)


@dataclass(frozen=True, eq=False, slots=True)
class ClosedLips:
    """Weights (F, T), the course (F,) of the lips, and findings."""

    weights: FloatArray
    course: FloatArray
    findings: list[Finding]


def close_lips(performance: SolvedPerformance, weights: FloatArray) -> ClosedLips | None:
    """Bring the character's lips together where the markers show that the performer's touch.

    Parameters
    ----------
    performance : SolvedPerformance
    weights : (F, T) float64
        The weights to close, corrected or not.

    Returns
    -------
    ClosedLips or None
        None of a face without lips, and of a take of weights.
    """
    face, solved, solution = performance.face, performance.solved, performance.solution
    if solution is None:
        return None
    apertures = lip_apertures_of(face, solved.names)
    if apertures is None:
        return None
    distances = lip_distances(face, performance.performed, solution, apertures.across, apertures.x)
    if distances is None:
        message = "no two markers of the lips part and meet with the mouth, so a touch is not seen"
        return ClosedLips(
            weights, np.zeros(len(weights)), [finding("LIPS_UNSEEN", "lips", message)]
        )
    tolerance = max(face.tolerance, _LEAST_TOLERANCE)
    near = performance.near_pins[:, apertures.evaluator.moving].max(axis=1, initial=0.0)
    # Near a pin the limit widens, to none at the pin.
    as_solved = apertures.opened(solved.weights)
    largest = largest_apertures(
        distances, as_solved, tolerance, solved.times, misfit=solution.misfit
    )
    if performance.is_exaggerated:
        performed = apertures.opened(performance.performed.weights)
        largest = _exaggerated(largest, as_solved, performed, tolerance)
    with np.errstate(divide="ignore"):
        largest = largest / (1.0 - near[:, None])
    closed = touching_lips(weights, largest, apertures)
    closed = as_open_as_seen(
        weights, closed, largest, distances.seen, apertures, tolerance, solved=as_solved
    )
    before, after = apertures.opened(weights), apertures.opened(closed)
    course = np.clip((before - after) / np.maximum(before, tolerance), 0.0, 1.0).max(axis=1)
    findings = _findings("LIPS_CLOSED", _CLOSED, before - after)
    return ClosedLips(closed, course, findings + _findings("LIPS_APART", _APART, after - largest))


def _exaggerated(
    largest: FloatArray, opened: FloatArray, performed: FloatArray, tolerance: float
) -> FloatArray:
    """Return limits (F, K) of lips that an exaggeration opens from `performed` to `opened` (F, K).

    What they allow beyond a contact [m] grows as the lips do; lips that touch go on to touch.
    """
    larger = np.maximum(opened, tolerance) / np.maximum(performed, tolerance)
    return np.where(larger > 1.0, tolerance + larger * (largest - tolerance), largest)


def _findings(code: str, message: str, apertures: FloatArray) -> list[Finding]:
    """Report apertures (F, K) [m]: by how much they were closed, or are still too wide."""
    frames = np.flatnonzero(apertures.max(axis=1) > _REPORTED)
    if not len(frames):
        return []
    numbers = len(frames), frames[0], frames[-1], 1000 * apertures.max()
    return [finding(code, "lips", message, *numbers)]
