"""Eyes that the solve narrows, though their markers do not come down and the other eye is open.

A blend shape that closes an eye is also solved to explain what other shapes cannot, as after a
frown. Both upper lids are moved by one motor command (A. Gay, M. Salmon, C. Windsor, "Hering's law,
the levators, and their relationship in disease states", 1967), and a wink brings the markers of its
eye down: a single eye that is narrowed without that is opened.
"""

from collections.abc import Mapping

import numpy as np
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from usdface.arrays import FloatArray
from usdface.closure.even_times import EvenTimes
from usdface.closure.lid_apertures import EYES, Eye, LidApertures
from usdface.closure.lid_pulses import LEAST_HEIGHT, lid_pulses
from usdface.findings import Finding, finding

__all__ = ["opened_findings", "shown_closing", "without_unshown_closing"]

# Height of a performer's blinks, in closed eyes of the character: of two real takes 0.44 and more.
_LEAST_BLINK = 0.4
# Share of a lid marker's motion that remains without that of the skin around it: up to the first a
# lowered brow brings the marker down, from the second on the lid closes (AnimFace: a frown 0.15 to
# 0.3, blinks 1), as in `closings`.
_DRAGGED, _OWN = 0.3, 0.5
# The limit holds for this long before and after [s], smoothed by half of it: it is to follow
# neither the noise of the markers nor each blink. Set by hand.
_AROUND = 0.2
# A weight that narrows an eye by so much more than the other one stays: it is hardly visible, a
# twentieth of the opening. Set by hand.
_HARDLY = 0.05
# Least fall of a weight that is reported.
_FALLEN = 0.1


def shown_closing(signal: FloatArray, by_itself: FloatArray | None, even: EvenTimes) -> FloatArray:
    """Return how far the markers show each eye as closed at most: (F, 2); infinite = not measured.

    Parameters
    ----------
    signal : (F, 2) float64
        `usdface.closure.lid_signal`; NaN in all frames of an eye that is not measured.
    by_itself : (F, 2) float64 or None
        The same of the lids by themselves (`lid_motion`): a blink under a raised brow, and none
        under a lowered one.
    even : EvenTimes
        Of the take.
    """
    most = np.full(signal.shape, np.inf)
    if len(signal) < 3:
        return most
    around = round(_AROUND / even.step)
    for eye in (0, 1):
        curves = [each[:, eye] for each in (signal, by_itself) if each is not None]
        if not all(np.isfinite(each).all() for each in curves):
            continue
        resampled = (even.resampled(each) for each in curves)
        closed = [lid_pulses(each, even.step)[0] - LEAST_HEIGHT for each in resampled]
        held = maximum_filter1d(_evidence(closed), 2 * around + 1)
        smooth = gaussian_filter1d(held, max(0.5 * around, 1e-3))
        most[:, eye] = even.of_frames(smooth) / (_LEAST_BLINK - LEAST_HEIGHT)
    return most


def _evidence(closed: list[FloatArray]) -> FloatArray:
    """Return how far an eye is closed (F,), of all that moves its marker and of the lid alone.

    A brow that is lowered takes the marker along, and the skin around measures most of that: only
    where the lid's own motion is a good share of all of it, it counts.
    """
    if len(closed) < 2:
        return closed[0].clip(min=0.0)
    all_of_it, by_itself = closed
    most = np.maximum(all_of_it, by_itself).clip(min=0.0)
    return np.clip((by_itself - _DRAGGED * all_of_it) / (_OWN - _DRAGGED), 0.0, most)


def without_unshown_closing(
    weights: FloatArray,
    solved: FloatArray,
    shown: FloatArray,
    by_eye: Mapping[Eye, LidApertures],
    near_pins: FloatArray,
    *,
    exaggerated: FloatArray | None = None,
) -> FloatArray:
    """Return weights (F, T) that close an eye as far as its markers show, or as the other eye is.

    Weights are lowered in proportion, but not below the other eye's, nor below where those before
    the correction end: so a second run on the result leaves it, unless the correction had closed
    the eye further.

    Parameters
    ----------
    weights : (F, T) float64
        Exaggerated and corrected.
    solved : (F, T) float64
        As the performer shows them.
    shown : (F, 2) float64
        As of `shown_closing`.
    by_eye : mapping of "left", "right" to LidApertures
    near_pins : (F, T) float64
        `usdface.retarget.pins.pin_nearness`: pinned weights stay.
    exaggerated : (F, T) float64, optional
        The solved weights with their exaggeration, before the correction; `solved`, if left out.
    """
    closers = [by_eye[eye].closer for eye in EYES if eye in by_eye]
    if len(set(closers)) < 2:
        return weights
    both = solved[:, closers]
    least = np.minimum(both, np.maximum(shown, both[:, ::-1]) + _HARDLY)
    near = near_pins[:, closers]
    # Exact at both ends: a second run finds what the first has left.
    kept = near * both + (1.0 - near) * least
    own, lowered = weights[:, closers], kept < both
    before = both if exaggerated is None else exaggerated[:, closers]
    size = np.divide(np.maximum(own, before), both, out=np.ones(both.shape), where=lowered)
    shown_by = np.minimum(own, size * kept)
    # As far as the other eye is, also where the correction closes both.
    least = np.minimum(own, own[:, ::-1] + _HARDLY)
    opened = weights.copy()
    opened[:, closers] = np.where(lowered, np.maximum(shown_by, least), own)
    return opened


def opened_findings(
    before: FloatArray, after: FloatArray, by_eye: Mapping[Eye, LidApertures]
) -> list[Finding]:
    """Report eyes that were opened, of weights (F, T) before and after."""
    findings = []
    for eye, apertures in by_eye.items():
        fallen = before[:, apertures.closer] - after[:, apertures.closer]
        frames = np.flatnonzero(fallen > _FALLEN)
        if len(frames):
            message = (
                "narrowed by a weight of up to {weight:.2f} more than its markers show, "
                "in {frame_count} frames ({first_frame} to {last_frame}), while the other eye is "
                "open: opened"
            )
            values = fallen.max(), len(frames), frames[0], frames[-1]
            findings.append(finding("EYE_OPENED", f"{eye} eye", message, *values))
    return findings
