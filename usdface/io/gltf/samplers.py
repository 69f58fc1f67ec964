"""Animation samplers of glTF as piecewise linear curves.

Source: glTF 2.0 specification, section 3.11 and appendix C (interpolation).
"""

from dataclasses import dataclass

import numpy as np
from pygltflib import AnimationSampler

from usdface.arrays import FloatArray
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.gltf.accessors import AccessorReader
from usdface.io.transforms import along

__all__ = ["Curve", "check_size", "curve_of"]

_TOLERANCE = 1e-4  # of a weight, a quaternion's component, ..., where cubic curves become lines
_MOST_PARTS = 256  # lines for one cubic segment
_MOST_NUMBERS = 2**27  # in the curves of one animation, 1 GiB


@dataclass(frozen=True, eq=False, slots=True)
class Curve:
    """Piecewise linear values: `times` (K,) [s], `values` (K, N).

    `keys` are the times [s] of the keys that the file has, which may be fewer. With `turning`
    values are unit quaternions x, y, z, w, and go along arcs.
    """

    times: FloatArray
    values: FloatArray
    keys: FloatArray
    turning: bool = False

    def at(self, times: FloatArray) -> FloatArray:
        """Return the values (F, N) at `times` (F,) [s]; the ends hold beyond them."""
        if np.array_equal(times, self.times):
            return self.values
        if not self.turning:
            columns = [np.interp(times, self.times, column) for column in self.values.T]
            return np.stack(columns, 1) if columns else np.zeros((len(times), 0))
        place = (np.searchsorted(self.times, times, side="right") - 1).clip(min=0)
        follow = (place + 1).clip(max=len(self.times) - 1)
        span = self.times[follow] - self.times[place]
        part = (times - self.times[place]) / np.where(span > 0, span, 1.0)
        return along(self.values, place, np.where(span > 0, part.clip(0, 1), 0.0))


def check_size(numbers: int, subject: str) -> None:
    """Refuse a small file that unfolds into huge curves, before they are allocated.

    Raises
    ------
    InputError
        If there are too many numbers.
    """
    if numbers > _MOST_NUMBERS:
        message = f"{subject} unfolds into more than {_MOST_NUMBERS} numbers; split it"
        raise InputError(message, "TOO_LARGE")


def curve_of(
    sampler: AnimationSampler, kind: str, width: int, reader: AccessorReader, subject: str
) -> tuple[Curve, list[Finding]]:
    """Return a sampler as a curve of `width` values a key.

    Steps become two keys one float32 apart; cubic curves become lines within 1e-4.

    Parameters
    ----------
    sampler : of pygltflib
    kind : {"SCALAR", "VEC3", "VEC4"}
        Of the output; VEC4 are quaternions.
    width : int
    reader : AccessorReader
    subject : str
        Name of the animation and its target, for messages.

    Raises
    ------
    InputError
        If times, interpolation or number of values are not as they must be.
    """
    times = reader.floats(sampler.input, "SCALAR")[:, 0]
    if (np.diff(times) <= 0).any():
        raise InputError(f"the times of {subject} must increase strictly")
    raw = reader.floats(sampler.output, kind).ravel()
    cubic = sampler.interpolation == "CUBICSPLINE"
    expected = len(times) * width * (3 if cubic else 1)
    if len(raw) != expected:
        raise InputError(
            f"{subject} has {len(raw)} values; expected {expected} "
            f"({len(times)} keys of {width} values)"
        )
    turning = kind == "VEC4"
    found: list[Finding] = []
    if cubic:
        curve, found = _resampled(times, raw.reshape(len(times), 3, width), subject)
    elif sampler.interpolation in (None, "LINEAR"):
        curve = Curve(times, raw.reshape(len(times), width), times)
    elif sampler.interpolation == "STEP":
        curve = _step_curve(times, raw.reshape(len(times), width))
    else:
        raise InputError(f"{subject} has the unknown interpolation {sampler.interpolation!r}")
    if not turning:
        return curve, found
    length = np.linalg.norm(curve.values, axis=1, keepdims=True)
    if not length.all():
        raise InputError(f"{subject} has a rotation that is the zero quaternion")
    return Curve(curve.times, curve.values / length, times, True), found


def _step_curve(times: FloatArray, values: FloatArray) -> Curve:
    """Keep each value until just before the next, different one."""
    jumps = np.flatnonzero((np.diff(values, axis=0) != 0).any(axis=1)) + 1
    before = np.nextafter(times[jumps].astype(np.float32), np.float32(-np.inf))
    fits = before > times[jumps - 1]
    jumps, before = jumps[fits], before[fits]
    return Curve(
        np.insert(times, jumps, before), np.insert(values, jumps, values[jumps - 1], axis=0), times
    )


def _resampled(times: FloatArray, keys: FloatArray, where: str) -> tuple[Curve, list[Finding]]:
    """Turn Hermite segments into lines; `keys` (K, 3, N): in-tangent, value, out-tangent.

    A chord over a step h misses a curve by at most h^2 / 8 times its second derivative,
    which is linear over a segment and so largest at one of its ends.
    """
    span = np.diff(times)[:, None]
    start, stop = keys[:-1, 1], keys[1:, 1]
    leave, arrive = keys[:-1, 2] * span, keys[1:, 0] * span
    bend = np.maximum(
        np.abs(6 * (stop - start) - 4 * leave - 2 * arrive),
        np.abs(6 * (start - stop) + 2 * leave + 4 * arrive),
    ).max(axis=1, initial=0.0)
    parts = np.ceil(np.sqrt(bend / (8 * _TOLERANCE))).clip(1, _MOST_PARTS).astype(np.int64)
    check_size(int(parts.sum()) * keys.shape[2], where)
    segment = np.repeat(np.arange(len(parts)), parts)
    step = np.arange(len(segment)) - np.repeat(np.cumsum(parts) - parts, parts)
    s = (step / parts[segment])[:, None]
    values = (
        (2 * s**3 - 3 * s**2 + 1) * start[segment]
        + (s**3 - 2 * s**2 + s) * leave[segment]
        + (3 * s**2 - 2 * s**3) * stop[segment]
        + (s**3 - s**2) * arrive[segment]
    )
    moments = np.append(times[segment] + s[:, 0] * span[segment, 0], times[-1])
    # As float32, like all keys: those of other curves at these times then are the same keys.
    moments = moments.astype(np.float32).astype(np.float64)
    kept = np.append(True, np.diff(moments) > 0)
    curve = Curve(moments[kept], np.concatenate([values, keys[-1:, 1]])[kept], times)
    error = (bend / (8 * parts**2)).max(initial=0.0)
    message = (
        "{cubic_key_count} cubic keys became {linear_key_count} linear ones, within {error:.1e}"
    )
    return curve, [finding("CURVE_RESAMPLED", where, message, len(times), len(curve.times), error)]
