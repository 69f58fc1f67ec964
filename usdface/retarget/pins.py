"""Pins: weights that an artist has fixed in some frames, blended into the frames around them."""

from collections.abc import Collection, Sequence

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.errors import InputError, did_you_mean
from usdface.findings import Finding, finding
from usdface.numerics.ramps import smooth_step
from usdface.options import PIN_REACH
from usdface.retarget.solver.bounds import Bounds
from usdface.setup.pin import Pin

__all__ = [
    "check_pins",
    "faded_at_pins",
    "pin_bounds",
    "pin_nearness",
    "pins_of_combinations",
    "with_pins",
]


def check_pins(pins: Sequence[Pin], names: Collection[str], frames: int) -> None:
    """Refuse pins of blend shapes that are not among `names`, or beyond a take of `frames` frames.

    Raises
    ------
    InputError
    """
    for pin in pins:
        if pin.shape not in names:
            raise InputError(
                f"a pin is of {pin.shape!r}, which is no blend shape of the rig"
                f"{did_you_mean(pin.shape, names)}",
                "SHAPE_UNKNOWN",
            )
        if pin.frames[-1] >= frames:
            raise InputError(
                f"{pin.shape!r} is pinned in frame {pin.frames[-1]}; the take has {frames} frames",
                "FRAMES_OUTSIDE",
            )


def pins_of_combinations(pins: Sequence[Pin], combined: Collection[str]) -> list[Finding]:
    """Return PIN_IGNORED for each pin of the combination shapes `combined`."""
    message = "a combination shape follows the blend shapes it combines; pin those"
    return [finding("PIN_IGNORED", pin.shape, message) for pin in pins if pin.shape in combined]


def pin_bounds(
    pins: Sequence[Pin],
    names: tuple[str, ...],
    times: FloatArray,
    weights: FloatArray,
    rows: FloatArray,
) -> Bounds:
    """Return bounds that fix pinned blend shapes within reach of their pins.

    There a blend shape follows its free solution `weights` (F, S) at `times` (F,) [s] plus an
    offset to the pin; beyond, it is free. `rows` (C, S) are inequalities, ``rows @ w <= 0``.
    """
    pinned, near_pin = _pinned(pins, names, times, weights)
    lower, upper = np.zeros(weights.shape), np.ones(weights.shape)
    lower[near_pin] = upper[near_pin] = pinned[near_pin]
    return Bounds(lower, upper, rows)


def with_pins(
    pins: Sequence[Pin], names: tuple[str, ...], times: FloatArray, weights: FloatArray
) -> FloatArray:
    """Return the weights (F, S) of a take that is not solved, offset to pass through the pins."""
    pinned, near_pin = _pinned(pins, names, times, weights)
    return np.where(near_pin, pinned, weights)


def faded_at_pins(
    pins: Sequence[Pin],
    names: tuple[str, ...],
    times: FloatArray,
    solved: FloatArray,
    corrected: FloatArray,
) -> FloatArray:
    """Return the corrected weights (F, T), faded towards the solved ones (F, T) at their pins.

    `times` (F,) [s] are those of the frames.
    """
    result = corrected.copy()
    for pin in pins:
        if pin.shape in names:
            column = names.index(pin.shape)
            nearness = _nearness(times, times[pin.frames])
            change = corrected[:, column] - solved[:, column]
            result[:, column] = solved[:, column] + (1.0 - nearness) * change
            result[pin.frames, column] = solved[pin.frames, column]
    return result


def pin_nearness(pins: Sequence[Pin], names: tuple[str, ...], times: FloatArray) -> FloatArray:
    """Return the nearness of frames at `times` (F,) [s] to the pins of each shape: (F, T), 0 to 1.

    1 at a pin, 0 beyond its reach.
    """
    near = np.zeros((len(times), len(names)))
    for pin in pins:
        if pin.shape in names:
            column = names.index(pin.shape)
            near[:, column] = np.maximum(near[:, column], _nearness(times, times[pin.frames]))
            near[pin.frames, column] = 1.0
    return near


def _pinned(
    pins: Sequence[Pin], names: tuple[str, ...], times: FloatArray, weights: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """Return the weights with pins, and where they differ from the old ones: both (F, S)."""
    pinned, near_pin = weights.copy(), np.zeros(weights.shape, dtype=bool)
    for pin in pins:
        if pin.shape in names:
            column, pin_times = names.index(pin.shape), times[pin.frames]
            nearness = _nearness(times, pin_times)
            change = np.interp(times, pin_times, pin.weights - weights[pin.frames, column])
            pinned[:, column] = np.clip(weights[:, column] + nearness * change, 0.0, 1.0)
            pinned[pin.frames, column] = pin.weights
            near_pin[:, column] = nearness > 0.0
    return pinned, near_pin


def _nearness(times: FloatArray, pin_times: FloatArray) -> FloatArray:
    """Return 1 at the pins' times [s], falling smoothly to 0 at the reach of a pin: (F,)."""
    after = np.searchsorted(pin_times, times).clip(max=len(pin_times) - 1)
    before = (after - 1).clip(min=0)
    apart = np.minimum(np.abs(times - pin_times[after]), np.abs(times - pin_times[before]))
    return smooth_step(1.0 - apart / PIN_REACH)
