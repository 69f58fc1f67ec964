"""Temporal blending: a correction begins and ends smoothly.

Additions are averaged; reductions to keep contact (`usdface.correction.contact`) get a smooth bound
that is nowhere below them. Frames on either side of a gap in the recording are not neighbours.
"""

from collections.abc import Callable

import numpy as np

from usdface.arrays import FloatArray
from usdface.numerics.hann_window import hann_average, hann_envelope
from usdface.takes import frame_step

__all__ = ["blend_frames", "blend_out", "blended"]

# A gap in the recording that is longer than this share of a transition parts two stretches, each
# with a transition of its own. Set by hand.
_GAP = 0.5


def blend_frames(times: FloatArray, blend_time: float) -> int:
    """Return the frames that a blend time [s] lasts, at the median step of `times` (F,) [s]."""
    if len(times) < 2:
        return 0
    return round(blend_time / frame_step(times))


def blended(added: FloatArray, frames: int, times: FloatArray | None) -> FloatArray:
    """Return the additions (F, S) of a correction averaged over `frames`; unchanged below 2.

    A curve that rises, holds and falls still does. `times` (F,) [s] tell gaps in the recording.
    """
    moved = np.flatnonzero(added.any(axis=0))
    if frames < 2 or not moved.size:
        return added
    smooth = np.zeros(added.shape)
    smooth[:, moved] = _by_stretch(added[:, moved], frames, times, hann_average)
    return smooth


def blend_out(
    weights: FloatArray,
    corrected: FloatArray,
    limited: FloatArray,
    frames: int,
    times: FloatArray | None,
) -> FloatArray:
    """Return corrected weights with smooth transitions to the limited ones.

    Parameters
    ----------
    weights, corrected, limited : (F, S) float64
        Everywhere `limited` is between the other two.
    frames : int
        Length of a transition; 0 or 1 gives `limited`.
    times : (F,) float64 [s], optional
        They tell gaps in the recording.

    Returns
    -------
    (F, S) float64
        Nowhere further from `weights` than `limited`; `corrected` where nothing is limited within
        `frames`.
    """
    change = corrected - weights
    bound = _by_stretch(np.abs(corrected - limited), frames, times, _smooth_bound)
    reduction = np.minimum(bound, np.abs(change))
    reduced = weights + np.copysign(np.abs(change) - reduction, change)
    return np.asarray(np.where(reduction > 0, reduced, corrected))


def _by_stretch(
    values: FloatArray,
    frames: int,
    times: FloatArray | None,
    smooth: Callable[[FloatArray, int], FloatArray],
) -> FloatArray:
    """Return values (F, S), smoothed over `frames` between gaps in the recording."""
    if times is None or len(times) < 2:
        return smooth(values, frames)
    cuts = np.flatnonzero(np.diff(times) > max(_GAP * frames, 1.5) * frame_step(times)) + 1
    return np.concatenate([smooth(part, frames) for part in np.split(values, cuts)])


def _smooth_bound(values: FloatArray, frames: int) -> FloatArray:
    """Return a smooth upper bound of each column of values (F, S) >= 0.

    The average by a Hann window of half of `frames` on either side, plus its largest shortfall
    within as many frames, averaged likewise: every value in that average is at least the frame's
    own shortfall.
    """
    moved = np.flatnonzero(values.any(axis=0))
    if frames < 2 or not moved.size:
        return values
    smooth = hann_average(values[:, moved], frames)
    bound = np.zeros(values.shape)
    bound[:, moved] = smooth + hann_envelope(np.maximum(values[:, moved] - smooth, 0.0), frames)
    return bound
