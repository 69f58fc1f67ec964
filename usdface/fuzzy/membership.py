"""Membership functions: how far a value belongs to a term, in [0, 1].

A kind is one row of `KINDS`: the names of its parameters and its function. Parameters are
ordered from left to right; the outermost ones may be infinite, which makes a shoulder that
stays at 1. Two equal neighbours make a step, never a division by zero.
"""

from collections.abc import Callable
from itertools import pairwise
from math import inf, isfinite, isnan

import numpy as np

from usdface.errors import InputError
from usdface.takes import FloatArray

__all__ = ["KINDS", "check_parameters", "membership"]


def _rising(x: FloatArray, foot: float, top: float) -> FloatArray:
    """0 up to `foot`, 1 from `top` on, a straight line between."""
    if foot == -inf:
        return np.ones_like(x)
    if foot == top:
        return np.asarray(x >= top, dtype=np.float64)
    return np.clip((x - foot) / (top - foot), 0.0, 1.0)


def _falling(x: FloatArray, top: float, foot: float) -> FloatArray:
    return _rising(-x, -foot, -top)


def _triangular(x: FloatArray, left: float, peak: float, right: float) -> FloatArray:
    return np.minimum(_rising(x, left, peak), _falling(x, peak, right))


def _trapezoidal(
    x: FloatArray, left: float, top_left: float, top_right: float, right: float
) -> FloatArray:
    return np.minimum(_rising(x, left, top_left), _falling(x, top_right, right))


def _ramp(x: FloatArray, foot: float, top: float) -> FloatArray:
    return _rising(x, foot, top) if foot < top else _falling(x, top, foot)


KINDS: dict[str, tuple[tuple[str, ...], Callable[..., FloatArray]]] = {
    "triangular": (("left", "peak", "right"), _triangular),
    "trapezoidal": (("left", "top_left", "top_right", "right"), _trapezoidal),
    "ramp": (("foot", "top"), _ramp),
}


def check_parameters(kind: str, parameters: tuple[float, ...]) -> None:
    """Check the parameters of a term.

    Raises
    ------
    InputError
        If the kind is unknown, or the parameters are too few, too many or out of order.
    """
    if kind not in KINDS:
        raise InputError(f"unknown kind of term {kind!r}; expected {', '.join(KINDS)}")
    wanted = KINDS[kind][0]
    found = f"{kind} ({', '.join(f'{p:g}' for p in parameters)})"
    if len(parameters) != len(wanted):
        raise InputError(f"{found}: expected {len(wanted)} parameters, {', '.join(wanted)}")
    if any(map(isnan, parameters)):
        raise InputError(f"{found}: parameters must be numbers")
    if kind == "ramp":
        if not all(map(isfinite, parameters)) or parameters[0] == parameters[1]:
            raise InputError(f"{found}: foot and top of a ramp must be finite and differ")
        return
    if any(a > b for a, b in pairwise(parameters)):
        raise InputError(f"{found}: parameters must ascend from left to right")
    if not all(map(isfinite, parameters[1:-1])) or parameters[0] == inf or parameters[-1] == -inf:
        raise InputError(f"{found}: only the outer feet may be infinite")


def membership(kind: str, parameters: tuple[float, ...], x: FloatArray) -> FloatArray:
    """Return how far each value belongs to a term; NaN belongs to none.

    Parameters
    ----------
    kind : {"triangular", "trapezoidal", "ramp"}
        "ramp": 0 at the foot, 1 at the top and beyond; the foot may lie on either side.
    parameters : tuple of float
        As `check_parameters` demands.
    x : (...) float64

    Returns
    -------
    (...) float64
        In [0, 1].
    """
    return np.where(np.isnan(x), 0.0, KINDS[kind][1](x, *parameters))
