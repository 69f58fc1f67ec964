"""Colour channels: one value per pixel, with a high contrast of dots to skin."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from usdface.errors import InputError, did_you_mean

__all__ = ["CHANNELS", "ColourChannel", "channel_of_colour", "parse_colour"]

Pixels = NDArray[np.uint8]
Signal = NDArray[np.int16]

_RED, _GREEN, _BLUE = range(3)
# Names of colours with the code values (8 bits) of their paints, which need not be exact.
_NAMED = {
    "green": (40, 170, 70),
    "blue": (40, 80, 190),
    "red": (200, 30, 40),
    "yellow": (230, 210, 50),
    "magenta": (210, 50, 170),
    "cyan": (50, 190, 200),
    "white": (245, 245, 245),
    "black": (20, 20, 20),
}
_SCALE = 256  # of the whole-number weights of a channel that is a direction in colour


@dataclass(frozen=True, slots=True)
class ColourChannel:
    """A signal made of red, green and blue in display encoding: high where the dots are.

    Attributes
    ----------
    name : str
        For people: ``"green - max(red, blue)"``.
    high, low : tuple of int
        Colour components: the smallest of `high` minus the largest of `low`. Without `low`
        the lightness of `high`, without `high` the darkness of `low`.
    weights : (float, float, float), optional
        In place of both: a direction in colour.
    """

    name: str
    high: tuple[int, ...] = ()
    low: tuple[int, ...] = ()
    weights: tuple[float, float, float] | None = None

    def signal(self, pixels: Pixels) -> Signal:
        """Return the signal (H, W) of pixels (H, W, 3), -255 to 255."""
        if self.weights is not None:
            whole = np.rint(np.array(self.weights) * _SCALE).astype(np.int32)
            total = pixels.astype(np.int32) @ whole
            return np.asarray(np.clip(total // _SCALE, -255, 255), dtype=np.int16)
        high = _extreme(pixels, self.high, np.minimum)
        low = _extreme(pixels, self.low, np.maximum)
        if high is None or low is None:
            return np.asarray(high if low is None else -low, dtype=np.int16)
        return np.asarray(high - low)


def _extreme(pixels: Pixels, components: tuple[int, ...], reduce: np.ufunc) -> Signal | None:
    if not components:
        return None
    result = pixels[..., components[0]].astype(np.int16)
    for component in components[1:]:
        reduce(result, pixels[..., component], out=result, casting="unsafe")
    return result


def _opponents() -> dict[str, ColourChannel]:
    names = {_RED: "red", _GREEN: "green", _BLUE: "blue"}
    found: dict[str, tuple[tuple[int, ...], tuple[int, ...]]] = {}
    for colour in names:
        others = tuple(other for other in names if other != colour)
        text = " and ".join(names[other] for other in others)
        found[f"{names[colour]} above {text}"] = ((colour,), others)
        found[f"{text} above {names[colour]}"] = (others, (colour,))
    # The two opponents nearest to a* and b* of CIELAB, for paints that are only a little off skin.
    found["green above red"] = ((_GREEN,), (_RED,))
    found["blue above red"] = ((_BLUE,), (_RED,))
    found["light"] = ((_RED, _GREEN, _BLUE), ())
    found["dark"] = ((), (_RED, _GREEN, _BLUE))
    return {name: ColourChannel(name, high, low) for name, (high, low) in found.items()}


CHANNELS: Mapping[str, ColourChannel] = MappingProxyType(_opponents())


def parse_colour(text: str) -> tuple[int, int, int]:
    """Return red, green and blue (0 to 255) of ``"green"``, ``"#3a7"`` or ``"#33aa77"``.

    Raises
    ------
    InputError
        If it is not one of these.
    """
    if text in _NAMED:
        return _NAMED[text]
    digits = text.removeprefix("#")
    if text.startswith("#") and len(digits) in (3, 6):
        digits = "".join(2 * digit for digit in digits) if len(digits) == 3 else digits
        try:
            red, green, blue = bytes.fromhex(digits)
            return red, green, blue
        except ValueError:
            pass
    raise InputError(
        f"the dots' colour {text!r} is not known; expected {', '.join(_NAMED)}, "
        f"a colour like #3a7, or the place x,y of a dot{did_you_mean(text, _NAMED)}",
        "SETTING_WRONG",
    )


def channel_of_colour(
    colour: tuple[float, float, float], around: tuple[float, float, float]
) -> ColourChannel:
    """Return the direction in colour space from the surroundings of the dots to the dots.

    Lightness counts a quarter as much as hue, because light on a face is uneven; between two greys
    only lightness differs.

    Parameters
    ----------
    colour, around : (float, float, float)
        Red, green, blue of the dots and of the skin, 0 to 255, in display encoding.
    """
    difference = np.subtract(colour, around)
    lightness = difference.mean()
    direction = difference - 0.75 * lightness
    length = float(direction @ direction) or 1.0
    # A dot's own signal is then its distance from the skin in code values.
    weights = direction * (np.sqrt(length) / length)
    red, green, blue = weights.tolist()
    return ColourChannel("the given colour", weights=(red, green, blue))
