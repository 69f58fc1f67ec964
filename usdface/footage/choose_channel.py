"""Choice of the colour channel, by the contrast of uniform, compact, round dots."""

from collections.abc import Iterable

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.errors import InputError
from usdface.footage.colour_channel import CHANNELS, ColourChannel, Pixels, channel_of_colour
from usdface.footage.detect import (
    CUT_OUT,
    DotModel,
    background,
    hues,
    measure,
    opponents,
)
from usdface.footage.dots import Dots
from usdface.numerics.robust_deviation import MEDIAN_TO_DEVIATION

__all__ = ["LEAST_DOTS", "MOST_DOTS", "choose_model", "colour_at", "model_of_colour"]

LEAST_DOTS, MOST_DOTS = 3, 400
# Thresholds that are tried: shares of the strongest signal, and the noise that they exceed.
_SHARES = (0.75, 0.6, 0.45, 0.32, 0.22, 0.15, 0.1)
_ABOVE_NOISE = 6.0
_WEAKEST = 10.0  # code values
# A dot: its roundness and fill (a disc seen at 65 degrees has 0.42), and how far radius and height
# of one differ from the median of all, as factors.
_ROUND, _FILL = 0.4, (0.75, 1.35)
_ALIKE_RADIUS, _ALIKE_HEIGHT = 1.7, 2.0
# A dot is at most this share of the image's larger side across.
_LARGEST = 1 / 20
# Upper bound of the log2 ratio of the dots' height to that of the strongest other component.
_MARGIN = 2.5
# Least cosine between the directions from the skin to the given and to the found colour, where both
# are this far from the skin.
_SAME_HUE, _COLOURED = 0.75, 40.0


def choose_model(pixels: Pixels, channels: Iterable[ColourChannel] | None = None) -> DotModel:
    """Choose channel and threshold for the dots of an image.

    Each channel is thresholded at several levels; the score is the number of dots that are round,
    of one size and of one height, times their share of all components, times the logarithm of their
    height over that of the strongest other component.

    Parameters
    ----------
    pixels : (H, W, 3) uint8
    channels : iterable of ColourChannel, optional
        Those to choose from; all of `CHANNELS` by default.

    Returns
    -------
    DotModel

    Raises
    ------
    InputError
        If no channel shows three dots that are alike.
    """
    best, chosen = 0.0, None
    for channel in CHANNELS.values() if channels is None else channels:
        signal = channel.signal(pixels)
        above = signal - background(signal)
        noise = MEDIAN_TO_DEVIATION * float(np.median(np.abs(above[::3, ::3])))
        strongest = float(np.partition(above.ravel()[::2], -40)[-40]) if above.size > 200 else 0.0
        for share in _SHARES:
            threshold = share * strongest
            if threshold < max(_WEAKEST, _ABOVE_NOISE * noise):
                break
            dots = measure(signal, above, threshold)
            alike = _alike(dots, max(pixels.shape[:2]))
            count = int(alike.sum())
            if not LEAST_DOTS <= count <= MOST_DOTS:
                continue
            height = float(np.median(dots.heights[alike]))
            score = count * _MARGIN
            if score <= best:
                continue
            score = count * min(_margin(above, dots[alike], height), _MARGIN)
            # Other components at the threshold of the dots, not at one where only dots are left.
            everything = measure(signal, above, CUT_OUT * height)
            score *= _purity(everything, count, float(np.median(dots.areas[alike])))
            if score > best:
                best, chosen = score, _model(pixels, channel, dots[alike])
    if chosen is None:
        raise InputError(
            "no dots are found: no colour shows three or more round spots that are alike; "
            "name their colour (--dots green, --dots '#3a7') or the place of one (--dots x,y)",
            "MARKERS_TOO_FEW",
        )
    return chosen


def _model(pixels: Pixels, channel: ColourChannel, dots: Dots) -> DotModel:
    hue = np.median(hues(pixels, dots), axis=0)
    # Surroundings of the dots: a ring of points at twice their radius.
    turns = np.linspace(0.0, 2 * np.pi, 12, endpoint=False)
    ring = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    places = dots.centres[:, None] + (2.0 * dots.axes[:, :1, None] + 2.0) * ring
    x, y = (places.reshape(-1, 2).T).astype(int)
    around = pixels[y.clip(0, pixels.shape[0] - 1), x.clip(0, pixels.shape[1] - 1)]
    skin = opponents(np.median(around, axis=0))
    return DotModel(
        channel,
        CUT_OUT * float(np.median(dots.heights)),
        float(np.median(dots.areas)),
        (float(hue[0]), float(hue[1])),
        (float(skin[0]), float(skin[1])),
    )


def _alike(dots: Dots, side: int) -> BoolArray:
    """Return which dots (K,) are round, small, and like most of the others."""
    shaped = (
        (dots.roundness > _ROUND)
        & (dots.fills > _FILL[0])
        & (dots.fills < _FILL[1])
        & (dots.radii < _LARGEST * side / 2)
    )
    alike: BoolArray = shaped
    for _ in range(4):
        if not alike.any():
            break
        radius, height = np.median(dots.radii[alike]), np.median(dots.heights[alike])
        alike = (
            shaped
            & (np.abs(np.log(dots.radii / radius)) < np.log(_ALIKE_RADIUS))
            & (np.abs(np.log(dots.heights / height)) < np.log(_ALIKE_HEIGHT))
        )
    return alike


def _margin(above: FloatArray, dots: Dots, height: float) -> float:
    """Return the log2 ratio of the dots' height to that of the strongest other, at least 0.1."""
    rest = above.copy()
    for (x, y), radius in zip(dots.centres.tolist(), dots.axes[:, 0].tolist(), strict=True):
        reach = int(1.5 * radius + 4)
        rest[max(int(y) - reach, 0) : int(y) + reach, max(int(x) - reach, 0) : int(x) + reach] = 0
    least = max(int(0.3 * float(np.median(dots.areas))), 1)
    strongest = float(np.partition(rest.ravel(), -least)[-least])
    return max(float(np.log2(height / max(strongest, 1.0))), 0.1)


def _purity(found: Dots, count: int, area: float) -> float:
    """Return the share of the dots among all components but specks."""
    return min(1.0, count / max(float((found.areas > 0.2 * area).sum()), 1.0))


def colour_at(
    pixels: Pixels, place: tuple[float, float]
) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Return the colour of the dot at a place, and that around it, 0 to 255.

    Parameters
    ----------
    pixels : (H, W, 3) uint8
    place : (float, float)
        x right, y down [px].

    Raises
    ------
    InputError
        If the place is outside of the image.
    """
    height, width = pixels.shape[:2]
    x, y = int(place[0]), int(place[1])
    if not (0 <= x < width and 0 <= y < height):
        raise InputError(
            f"the dot at {x},{y} is outside of the image of {width} x {height} pixels",
            "SETTING_WRONG",
        )
    inner = pixels[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2].reshape(-1, 3)
    reach = max(6, round(_LARGEST * max(width, height)))
    outer = pixels[max(y - reach, 0) : y + reach + 1, max(x - reach, 0) : x + reach + 1]
    return _triple(np.median(inner, axis=0)), _triple(np.median(outer.reshape(-1, 3), axis=0))


def _triple(colour: np.ndarray) -> tuple[float, float, float]:
    return float(colour[0]), float(colour[1]), float(colour[2])


def model_of_colour(
    pixels: Pixels, colour: tuple[float, float, float], around: tuple[float, float, float] | None
) -> DotModel:
    """Choose channel and threshold for dots of a known colour.

    Parameters
    ----------
    pixels : (H, W, 3) uint8
    colour : (float, float, float)
        0 to 255.
    around : (float, float, float), optional
        Colour around the dots; by default the most common one of the image.

    Raises
    ------
    InputError
        If nothing of this colour is round.
    """
    if around is None:
        around = _triple(np.median(pixels[::4, ::4].reshape(-1, 3), axis=0))
    channel = channel_of_colour(colour, around)
    own = [each for each in CHANNELS.values() if _shows(each, colour, around)]
    model = choose_model(pixels, [channel, *own])
    wanted, there = opponents(np.array(colour, dtype=float)), np.array(model.hue)
    wanted, there = wanted - model.skin, there - model.skin
    sizes = float(np.hypot(*wanted) * np.hypot(*there))
    if sizes > _COLOURED**2 and float(wanted @ there) < _SAME_HUE * sizes:
        red, green, blue = (round(value) for value in colour)
        raise InputError(
            f"no dots of the colour #{red:02x}{green:02x}{blue:02x} are found; look at their "
            "colour in the image, or name the place of one (--dots x,y)",
            "MARKERS_TOO_FEW",
        )
    return model


def _shows(
    channel: ColourChannel, colour: tuple[float, float, float], around: tuple[float, float, float]
) -> bool:
    """Return whether a channel is at least half as high for a colour as for any other."""
    pair = np.rint([[colour, around]]).astype(np.uint8)
    dot, skin = channel.signal(pair)[0].tolist()
    return dot - skin > 0.5 * max(np.ptp(colour), _WEAKEST) and "light" not in channel.name
