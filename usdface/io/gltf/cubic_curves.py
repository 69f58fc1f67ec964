"""Cubic curves of glTF as lines: at which times they are sampled, and their values there.

Source: glTF 2.0 specification, appendix C (cubic spline interpolation).
"""

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.findings import Finding, finding
from usdface.io.gltf.animation_size import check_size
from usdface.numerics.frame_blocks import by_blocks

__all__ = ["sampled_hermite"]

_MOST_PARTS = 1024  # lines for one cubic segment; tangents may ask for any number
_BLOCK = 256  # steps at once: with 500 values each 1 MB


def sampled_hermite(
    times: FloatArray, keys: FloatArray, tolerance: float, where: str
) -> tuple[FloatArray, FloatArray, list[Finding]]:
    """Turn Hermite segments into lines, more where they bend more.

    A line over a step h misses a curve by at most h^2 / 8 times its second derivative,
    which is linear over a segment and so largest at an end of the step. A step that misses by more
    than `tolerance` is halved, at the time in it that is a multiple of the largest power of two
    of a second: curves with other keys are then sampled at the same times, so that their union
    is as large as the largest of them, and these times are float32 numbers without rounding.

    Parameters
    ----------
    times : (K,) float64 [s]
    keys : (K, 3, N) float64
        In-tangent, value and out-tangent of N values.
    tolerance : float
        Of a value.
    where : str
        Name of the animation and its target, for messages.

    Returns
    -------
    times : (T,) float64 [s]
        The keys and the times between them.
    values : (T, N) float64
    list of Finding

    Raises
    ------
    InputError
        If there are too many values.
    """
    span = np.diff(times)
    leave, arrive = keys[:-1, 2] * span[:, None], keys[1:, 0] * span[:, None]
    ends = keys[:-1, 1], keys[1:, 1]
    # Second derivatives [1/s^2] at both ends of each segment.
    first = 6 * (ends[1] - ends[0]) - 4 * leave - 2 * arrive
    last = 6 * (ends[0] - ends[1]) + 2 * leave + 4 * arrive
    bends = first / span[:, None] ** 2, last / span[:, None] ** 2
    moments, segment, error = _moments(times, bends, tolerance, where)
    s = ((moments - times[segment]) / span[segment])[:, None]
    values = (
        (2 * s**3 - 3 * s**2 + 1) * ends[0][segment]
        + (s**3 - 2 * s**2 + s) * leave[segment]
        + (3 * s**2 - 2 * s**3) * ends[1][segment]
        + (s**3 - s**2) * arrive[segment]
    )
    moments, values = np.append(moments, times[-1]), np.concatenate([values, keys[-1:, 1]])
    message = (
        "{cubic_key_count} cubic keys became {linear_key_count} linear ones, within {error:.1e}"
    )
    found = finding("CURVE_RESAMPLED", where, message, len(times), len(moments), error)
    return moments, values, [found]


def _moments(
    times: FloatArray, bends: tuple[FloatArray, FloatArray], tolerance: float, where: str
) -> tuple[FloatArray, IntArray, float]:
    """Return where steps begin (T,) [s], the segment of each, and the largest error."""
    span = np.diff(times)
    segment = np.arange(len(span))
    low, high = times[:-1], times[1:]
    done: list[tuple[FloatArray, IntArray]] = []
    error, count = 0.0, 0
    while len(segment):
        check_size((count + len(segment)) * bends[0].shape[1], where)
        missed = (high - low) ** 2 / 8 * _bend(times, bends, segment, low, high)
        middle = _roundest(low, high)
        parted = (missed > tolerance) & (high - low > span[segment] / _MOST_PARTS)
        parted &= (middle > low) & (middle < high)
        error = max(error, float(missed[~parted].max(initial=0.0)))
        done.append((low[~parted], segment[~parted]))
        count += int((~parted).sum())
        low = np.concatenate([low[parted], middle[parted]])
        high = np.concatenate([middle[parted], high[parted]])
        segment = np.tile(segment[parted], 2)
    moments = np.concatenate([np.zeros(0), *(m for m, _ in done)])
    order = np.argsort(moments)
    return moments[order], np.concatenate([segment, *(s for _, s in done)])[order], error


def _bend(
    times: FloatArray,
    bends: tuple[FloatArray, FloatArray],
    segment: IntArray,
    low: FloatArray,
    high: FloatArray,
) -> FloatArray:
    """Return the largest second derivative (T,) [1/s^2] of any value in each step."""
    span = times[segment + 1] - times[segment]
    ends = [((end - times[segment]) / span)[:, None] for end in (low, high)]

    def largest(steps: slice) -> FloatArray:
        first, last = (bend[segment[steps]] for bend in bends)
        among = ((1 - part[steps]) * first + part[steps] * last for part in ends)
        highest = [np.abs(bend).max(axis=1, initial=0.0) for bend in among]
        return np.asarray(np.max(highest, axis=0))

    return by_blocks(len(segment), largest, _BLOCK)


def _roundest(low: FloatArray, high: FloatArray) -> FloatArray:
    """Return in each step the multiple of the largest power of two; `low` if float32 has none.

    A step is longer than half of the power that it starts with, so that it has a multiple of a
    quarter of it.
    """
    found = low.copy()
    power = 2.0 ** np.ceil(np.log2(high - low))
    finest = np.spacing(np.maximum(np.abs(low), np.abs(high)).astype(np.float32))
    for _ in range(3):
        number = np.floor(high / power) * power
        number = np.where(number < high, number, number - power)
        better = (found == low) & (number > low) & (power >= finest)
        found = np.where(better, number, found)
        power = power / 2
    return found
