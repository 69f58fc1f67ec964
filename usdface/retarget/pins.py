"""Pins: weights that an artist has fixed in some frames, and how their neighbours bend to them."""

from collections.abc import Sequence

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.options import PIN_REACH
from usdface.retarget.bounds import Bounds
from usdface.retarget_setup import Pin

__all__ = ["bent_to_pins", "kept_at_pins", "pin_bounds"]


def pin_bounds(
    pins: Sequence[Pin],
    names: tuple[str, ...],
    times: FloatArray,
    weights: FloatArray,
    rows: FloatArray,
) -> Bounds:
    """Return bounds that hold pinned shapes where they are pinned, and on the way there.

    Within reach of a pin the shape follows its free solution `weights` (F, S), bent so that it
    passes through the pin; beyond, it is free. `rows` (C, S) are inequalities, ``rows @ w <= 0``.
    """
    bent, held = _bent(pins, names, times, weights)
    lower, upper = np.zeros(weights.shape), np.ones(weights.shape)
    lower[held] = upper[held] = bent[held]
    return Bounds(lower, upper, rows, np.zeros(len(rows)))


def bent_to_pins(
    pins: Sequence[Pin], names: tuple[str, ...], times: FloatArray, weights: FloatArray
) -> FloatArray:
    """Return weights (F, S) that pass through the pins: those of a take that is not solved."""
    bent, held = _bent(pins, names, times, weights)
    return np.where(held, bent, weights)


def kept_at_pins(
    pins: Sequence[Pin],
    names: tuple[str, ...],
    times: FloatArray,
    solved: FloatArray,
    corrected: FloatArray,
) -> FloatArray:
    """Return the corrected weights (F, T), faded out towards the pins of the solved ones."""
    result = corrected.copy()
    for pin in pins:
        if pin.shape in names:
            column = names.index(pin.shape)
            near = _nearness(times, times[pin.frames])
            change = corrected[:, column] - solved[:, column]
            result[:, column] = solved[:, column] + (1.0 - near) * change
            result[pin.frames, column] = solved[pin.frames, column]
    return result


def _bent(
    pins: Sequence[Pin], names: tuple[str, ...], times: FloatArray, weights: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """Return the bent weights, and where they are not the old ones: both (F, S)."""
    bent, held = weights.copy(), np.zeros(weights.shape, dtype=bool)
    for pin in pins:
        if pin.shape in names and len(pin.frames):
            column, moments = names.index(pin.shape), times[pin.frames]
            near = _nearness(times, moments)
            change = np.interp(times, moments, pin.weights - weights[pin.frames, column])
            bent[:, column] = np.clip(weights[:, column] + near * change, 0.0, 1.0)
            bent[pin.frames, column] = pin.weights
            held[:, column] = near > 0.0
    return bent, held


def _nearness(times: FloatArray, moments: FloatArray) -> FloatArray:
    """Return 1 at the moments, falling smoothly to 0 at the reach of a pin: (F,)."""
    after = np.searchsorted(moments, times).clip(max=len(moments) - 1)
    before = (after - 1).clip(min=0)
    apart = np.minimum(np.abs(times - moments[after]), np.abs(times - moments[before]))
    part = 1.0 - np.minimum(apart / PIN_REACH, 1.0)
    return np.asarray(part**2 * (3.0 - 2.0 * part))
