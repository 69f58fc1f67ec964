"""Animation samplers of glTF as piecewise linear curves.

Source: glTF 2.0 specification, section 3.11 and appendix C (interpolation).
"""

from dataclasses import dataclass

import numpy as np
from pygltflib import AnimationSampler

from usdface.arrays import FloatArray
from usdface.errors import InputError
from usdface.findings import Finding
from usdface.io.gltf.accessors import AccessorReader
from usdface.io.gltf.cubic_curves import sampled_hermite
from usdface.io.transforms import along

__all__ = ["Curve", "curve_of"]


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


def curve_of(
    sampler: AnimationSampler,
    kind: str,
    width: int,
    reader: AccessorReader,
    subject: str,
    tolerance: float,
) -> tuple[Curve, list[Finding]]:
    """Return a sampler as a curve of `width` values a key.

    Steps become two keys one float32 apart; cubic curves become lines.

    Parameters
    ----------
    sampler : of pygltflib
    kind : {"SCALAR", "VEC3", "VEC4"}
        Of the output; VEC4 are quaternions.
    width : int
    reader : AccessorReader
    subject : str
        Name of the animation and its target, for messages.
    tolerance : float
        Of a value, by which lines may miss a cubic curve.

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
        keys = raw.reshape(len(times), 3, width)
        moments, values, found = sampled_hermite(times, keys, tolerance, subject)
        curve = Curve(moments, values, times)
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
