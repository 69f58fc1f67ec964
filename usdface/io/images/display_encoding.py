"""Pixels of any colour space as code values for display."""

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["for_display"]


def for_display(pixels: NDArray[Any], space: str, exposure: float) -> NDArray[np.uint8]:
    """Return pixels (H, W, C) of a named colour space as code values for display.

    `exposure` is a factor on linear light.
    """
    named = space.lower()
    linear = named.startswith(("lin", "scene_linear", "aces", "acescg")) or "linear" in named
    log = "log" in named or "cineon" in named
    floating = pixels.dtype == np.float16
    if pixels.dtype == np.uint8 and not (linear or log):
        return pixels
    encoding = "log" if log else "linear" if linear or (floating and not named) else "display"
    table = _table(pixels.dtype.str, encoding, exposure)
    return np.asarray(table[pixels.view(np.uint16) if floating else pixels])


@lru_cache(maxsize=8)
def _table(dtype: str, encoding: str, exposure: float) -> NDArray[np.uint8]:
    """Return the code value for display of every value of a type."""
    kind = np.dtype(dtype)
    if kind == np.float16:
        values = np.arange(2**16, dtype=np.uint16).view(np.float16).astype(np.float64)
        values = np.nan_to_num(values, nan=0.0, posinf=1e6, neginf=0.0)
    else:
        largest = np.iinfo(kind).max
        values = np.arange(largest + 1) / largest
    if encoding == "log":  # Cineon: 0.002 of density a code value of 10 bits, white at 685
        values = 10 ** ((values * 1023 - 685) * 0.002 / 0.6)
    if encoding != "display":
        values = (exposure * values).clip(0.0, 1.0)
        curve = 1.055 * values ** (1 / 2.4) - 0.055  # IEC 61966-2-1
        values = np.where(values <= 0.0031308, 12.92 * values, curve)
    return np.rint(255.0 * values.clip(0.0, 1.0)).astype(np.uint8)
