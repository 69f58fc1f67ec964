"""Membership functions of terms, with values in [0, 1].

A kind is one row of `KINDS`: the names of its parameters and its function. Parameters are
ordered from left to right; the outermost ones may be infinite, which makes a shoulder that
stays at 1. Two equal neighbours make a step, never a division by zero. Smooth kinds have finite
parameters: Gaussian, sigmoid and bell are nowhere 0, so their rules always fire a little.

The consequents of a Sugeno system, `CONSEQUENTS`, are terms too, but numbers, not degrees.
"""

from collections.abc import Callable
from itertools import pairwise
from math import inf, isfinite, isnan

import numpy as np

from usdface.arrays import FloatArray
from usdface.errors import InputError

__all__ = ["CONSEQUENTS", "KINDS", "check_parameters", "membership", "places"]


def _rise(x: FloatArray, foot: float, top: float) -> FloatArray:
    """Straight line through 0 at `foot` and 1 at `top`, not yet cut off; a step where they meet."""
    if foot == -inf:
        return np.ones_like(x)
    if foot == top:
        return np.asarray(x >= top, dtype=np.float64)
    line = x - foot
    line /= top - foot
    return line


def _fall(x: FloatArray, top: float, foot: float) -> FloatArray:
    if foot == inf:
        return np.ones_like(x)
    if foot == top:
        return np.asarray(x <= top, dtype=np.float64)
    line = foot - x
    line /= foot - top
    return line


def _cut(line: FloatArray) -> FloatArray:
    return line.clip(0.0, 1.0, out=line)


def _rising(x: FloatArray, foot: float, top: float) -> FloatArray:
    """0 up to `foot`, 1 from `top` on, a straight line between."""
    return _cut(_rise(x, foot, top))


def _triangular(x: FloatArray, left: float, peak: float, right: float) -> FloatArray:
    rise = _rise(x, left, peak)
    return _cut(np.minimum(rise, _fall(x, peak, right), out=rise))


def _trapezoidal(
    x: FloatArray, left: float, top_left: float, top_right: float, right: float
) -> FloatArray:
    rise = _rise(x, left, top_left)
    return _cut(np.minimum(rise, _fall(x, top_right, right), out=rise))


def _ramp(x: FloatArray, foot: float, top: float) -> FloatArray:
    return _cut(_rise(x, foot, top) if foot < top else _fall(x, top, foot))


def _s_shape(x: FloatArray, foot: float, top: float) -> FloatArray:
    """Two parabolas that meet half-way: 0 up to `foot`, 1 from `top` on."""
    rise = _rising(x, foot, top)
    return np.where(rise <= 0.5, 2.0 * rise * rise, 1.0 - 2.0 * (1.0 - rise) * (1.0 - rise))


def _z_shape(x: FloatArray, top: float, foot: float) -> FloatArray:
    return _s_shape(-x, -foot, -top)


def _pi_shape(
    x: FloatArray, left: float, top_left: float, top_right: float, right: float
) -> FloatArray:
    return _s_shape(x, left, top_left) * _z_shape(x, top_right, right)


def _gaussian(x: FloatArray, mean: float, deviation: float) -> FloatArray:
    # exp(-800) is 0 to the last bit, and squares farther away may overflow.
    away = np.clip((x - mean) / deviation, -40.0, 40.0)
    return np.exp(-0.5 * away * away)


def _gaussian_pair(
    x: FloatArray, left: float, left_deviation: float, right: float, right_deviation: float
) -> FloatArray:
    """1 between the means, a Gaussian's flank on either side."""
    flanks = _gaussian(np.minimum(x, left), left, left_deviation)
    return flanks * _gaussian(np.maximum(x, right), right, right_deviation)


def _sigmoid(x: FloatArray, inflection: float, slope: float) -> FloatArray:
    # The exponent is kept where exp is finite; beyond, the answer is 0 to the last bit.
    return 1.0 / (1.0 + np.exp(np.minimum(-slope * (x - inflection), 700.0)))


def _bell(x: FloatArray, centre: float, width: float, slope: float) -> FloatArray:
    with np.errstate(over="ignore"):  # 1 / inf is the 0 that is meant
        return 1.0 / (1.0 + np.abs((x - centre) / width) ** (2.0 * slope))


def _points(x: FloatArray, *points: float) -> FloatArray:
    """Straight lines from point to point; level before the first and after the last."""
    return np.asarray(np.interp(x, points[::2], points[1::2]))


KINDS: dict[str, tuple[tuple[str, ...], Callable[..., FloatArray]]] = {
    "triangular": (("left", "peak", "right"), _triangular),
    "trapezoidal": (("left", "top_left", "top_right", "right"), _trapezoidal),
    "ramp": (("foot", "top"), _ramp),
    "gaussian": (("mean", "deviation"), _gaussian),
    "gaussian_pair": (("left", "left_deviation", "right", "right_deviation"), _gaussian_pair),
    "sigmoid": (("inflection", "slope"), _sigmoid),
    "bell": (("centre", "width", "slope"), _bell),
    "s_shape": (("foot", "top"), _s_shape),
    "z_shape": (("top", "foot"), _z_shape),
    "pi_shape": (("left", "top_left", "top_right", "right"), _pi_shape),
    "points": (("x", "height"), _points),  # as many pairs as there are points
}
# Sugeno of order zero, and of order one: a factor for each input, then the constant.
CONSEQUENTS = ("constant", "linear")

_POSITIVE = {"deviation", "left_deviation", "right_deviation", "width"}
_NO_PLACES = _POSITIVE | {"slope", "height"}
_LINEAR = {"triangular", "trapezoidal"}
_SMOOTH_STEPS = {"s_shape", "z_shape", "pi_shape"}


def check_parameters(kind: str, parameters: tuple[float, ...]) -> None:
    """Check the parameters of a term.

    Raises
    ------
    InputError
        If the kind is unknown, or the parameters are too few, too many or out of order.
    """
    wanted = _names(kind, len(parameters))
    found = f"{kind} ({', '.join(f'{p:g}' for p in parameters)})"
    names = ", ".join(dict.fromkeys(wanted))
    if len(parameters) != len(wanted):
        raise InputError(f"{found}: expected {len(wanted)} parameters, {', '.join(wanted)}")
    if any(map(isnan, parameters)):
        raise InputError(f"{found}: a parameter is not a number; expected {names}")
    finite = parameters[1:-1] if kind in _LINEAR else parameters
    if kind == "ramp" and (parameters[0] == parameters[1] or not all(map(isfinite, finite))):
        raise InputError(f"{found}: expected foot and top of a ramp finite and apart")
    if kind in _LINEAR | _SMOOTH_STEPS and any(a > b for a, b in pairwise(parameters)):
        raise InputError(f"{found}: expected {names} from left to right")
    if kind in _LINEAR and not (
        all(map(isfinite, finite)) and parameters[0] < inf and parameters[-1] > -inf
    ):
        raise InputError(f"{found}: expected finite parameters but for the outer feet")
    if not all(map(isfinite, finite)):
        raise InputError(f"{found}: expected finite {names}")
    if kind == "points":
        _check_points(found, parameters)
    for name, value in zip(wanted, parameters, strict=True):
        if (name in _POSITIVE and value <= 0) or (name == "slope" and value == 0):
            allowed = "above 0" if name in _POSITIVE else "other than 0"
            raise InputError(f"{found}: {name} is {value:g}; expected a number {allowed}")
    if kind == "bell" and parameters[2] < 0:
        raise InputError(f"{found}: slope is {parameters[2]:g}; expected a number above 0")


def _check_points(found: str, parameters: tuple[float, ...]) -> None:
    if any(a >= b for a, b in pairwise(parameters[::2])):
        raise InputError(f"{found}: expected points with ascending x, from left to right")
    if not all(0 <= height <= 1 for height in parameters[1::2]):
        raise InputError(f"{found}: expected heights of points from 0 to 1")


def places(kind: str, parameters: tuple[float, ...]) -> tuple[float, ...]:
    """Return the finite parameters that are values of x, not widths or slopes."""
    named = zip(_names(kind, len(parameters)), parameters, strict=True)
    return tuple(p for name, p in named if name not in _NO_PLACES and isfinite(p))


def _names(kind: str, count: int) -> tuple[str, ...]:
    if kind == "constant":
        return ("value",)
    if kind == "linear":
        return (*(f"factor_{i + 1}" for i in range(count - 1)), "constant")
    if kind not in KINDS:
        raise InputError(
            f"unknown kind of term {kind!r}; expected {', '.join((*KINDS, *CONSEQUENTS))}"
        )
    return KINDS[kind][0] * (max(2, (count + 1) // 2) if kind == "points" else 1)


def membership(kind: str, parameters: tuple[float, ...], x: FloatArray) -> FloatArray:
    """Return how far each value belongs to a term; NaN belongs to none.

    Parameters
    ----------
    kind : key of `KINDS`
        "ramp": 0 at the foot, 1 at the top and beyond; the foot may lie on either side.
        "gaussian": exp(-(x - mean)^2 / (2 deviation^2)); "gaussian_pair": its flanks, 1 between
        (where the left mean lies right of the right one, their product, nowhere 1).
        "sigmoid": 1 / (1 + exp(-slope (x - inflection))).
        "bell": 1 / (1 + |(x - centre) / width|^(2 slope)).
        "s_shape", "z_shape", "pi_shape": as ramp, ramp and trapezoidal, with two parabolas for
        each straight flank.
        "points": x and height of each, joined by straight lines, level beyond.
    parameters : tuple of float
        As `check_parameters` demands.
    x : (...) float64

    Returns
    -------
    (...) float64
        In [0, 1].
    """
    degree = KINDS[kind][1](x, *parameters)
    missing = np.isnan(x)
    return np.where(missing, 0.0, degree) if missing.any() else degree
