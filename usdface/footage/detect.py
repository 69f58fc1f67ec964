"""Detection of dots in one image: those components that look like dots, with sub-pixel centres."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.footage.colour_channel import ColourChannel, Pixels, Signal
from usdface.footage.components import EDGE, find_components
from usdface.footage.dots import Dots, no_dots
from usdface.numerics.robust_deviation import MEDIAN_TO_DEVIATION

__all__ = [
    "CUT_OUT",
    "Box",
    "DotModel",
    "background",
    "detect_dots",
    "hues",
    "measure",
    "opponents",
]

Box = tuple[int, int, int, int]  # left, top, right, bottom [px], the last two excluded

# Threshold of segmentation, as a share of the dots' height above the background.
CUT_OUT = 0.3
# Most components that are measured: more are texture, not dots.
_MOST = 2000
# Pixels of the smallest dot; a smaller one has no shape.
_SMALLEST = 6
# A component's short axis over its long one, and its area over that of the ellipse, at least.
_SLIM, _RAGGED = 0.08, 0.5
_CELLS = 48  # of the local background across an image
# Shares of a dot's height that count as none and all of it. Below is noise of the skin, above is
# highlight or shade on the paint; both would pull the centre.
_FOOT, _PLATEAU = 0.15, 0.8
# Variance of a pixel's own square [px^2].
_PIXEL_VARIANCE = 1.0 / 12.0
# Factors that areas may be smaller and larger by than the usual one, where that is known.
_RANGE = (16, 5)
# A dot's hue lies between the skin's and the usual one, at least this share along that line and at
# most this share beside it: a small dot is mixed with skin, an iris or a leaf is in another
# direction. A faint dot is a pixel wide, and mixed with more skin.
_ALONG, _BESIDE, _FAINT_ALONG = 0.3, 0.3, 0.1
# Hues of dots and skin closer than this are not compared: dots are dark or light then.
_GREY = 25.0
_NOISE_FLOOR = 0.3  # code values: rounding to whole ones


@dataclass(frozen=True, slots=True)
class DotModel:
    """The look of the dots in a take.

    Attributes
    ----------
    channel : ColourChannel
    threshold : float
        Signal above the local background, in code values.
    area : float [px^2]
        Median of the dots' areas; 0 = not known yet.
    hue, skin : (float, float)
        Opponent colours, red - green and yellow - blue, of the dots and of their surroundings.
    """

    channel: ColourChannel
    threshold: float
    area: float = 0.0
    hue: tuple[float, float] = (0.0, 0.0)
    skin: tuple[float, float] = (0.0, 0.0)


def background(signal: Signal) -> FloatArray:
    """Return the local background of a signal (H, W): the median of each cell, interpolated.

    Cells are wider than any dot: a 48th of the larger side, at most the smaller, smoothed over 3.
    """
    height, width = signal.shape
    step = max(1, min(max(signal.shape) // _CELLS, height, width))
    rows, columns = max(1, height // step), max(1, width // step)
    thin = max(1, step // 6)
    part = signal[: rows * step, : columns * step].reshape(rows, step, columns, step)
    each = part[:, ::thin, :, ::thin].transpose(0, 2, 1, 3).reshape(rows, columns, -1)
    cells = ndimage.median_filter(np.median(each, axis=2).astype(np.float32), 3, mode="nearest")
    y = ((np.arange(height) + 0.5) / step - 0.5).clip(0, rows - 1)
    x = ((np.arange(width) + 0.5) / step - 0.5).clip(0, columns - 1)
    top, left = (
        np.minimum(y.astype(int), max(rows - 2, 0)),
        np.minimum(x.astype(int), max(columns - 2, 0)),
    )
    down, right = np.minimum(top + 1, rows - 1), np.minimum(left + 1, columns - 1)
    v, u = (y - top).astype(np.float32)[:, None], (x - left).astype(np.float32)[None]
    lines = cells[top] * (1 - v) + cells[down] * v
    return np.asarray(lines[:, left] * (1 - u) + lines[:, right] * u)


def detect_dots(pixels: Pixels, model: DotModel, box: Box | None = None) -> Dots:
    """Find the dots of an image.

    Parameters
    ----------
    pixels : (H, W, 3) uint8
        In display encoding.
    model : DotModel
        Components far from its area are left out, where it is known.
    box : Box, optional
        Part of the image to look at.

    Returns
    -------
    Dots
        In no particular order.
    """
    left, top, right, bottom = box or (0, 0, pixels.shape[1], pixels.shape[0])
    signal = model.channel.signal(pixels[top:bottom, left:right])
    found = measure(signal, signal - background(signal), model.threshold, model.area)
    found = _moved(found, left, top)
    if not len(found):
        return found
    own = hues(pixels, found)
    found = replace(found, faint=~_of_hue(own, model, _ALONG))
    return found[_of_hue(own, model, _FAINT_ALONG)]


def hues(pixels: Pixels, dots: Dots) -> FloatArray:
    """Return opponent colours, red - green and yellow - blue (K, 2), at the centre of each dot."""
    x, y = dots.centres.astype(int).T
    steps = np.array([-1, 0, 1])
    rows = (y[:, None] + steps).clip(0, pixels.shape[0] - 1)
    columns = (x[:, None] + steps).clip(0, pixels.shape[1] - 1)
    return opponents(pixels[rows[:, :, None], columns[:, None]].mean(axis=(1, 2)))


def opponents(colours: FloatArray) -> FloatArray:
    """Return opponent colours, red - green and yellow - blue (..., 2), of colours (..., 3)."""
    red, green, blue = (colours[..., k] for k in range(3))
    return np.stack([red - green, (red + green) / 2 - blue], axis=-1)


def _of_hue(found: FloatArray, model: DotModel, least: float) -> BoolArray:
    """Return which hues (K, 2) are those of dots, `least` or more of the way from the skin's."""
    way, own = np.subtract(model.hue, model.skin), found - model.skin
    length = float(np.hypot(*way))
    if length < _GREY:
        return np.ones(len(found), dtype=bool)
    along, beside = own @ way / length, own @ (-way[1], way[0]) / length
    return np.asarray((along > least * length) & (np.abs(beside) < _BESIDE * length))


def _moved(dots: Dots, left: int, top: int) -> Dots:
    return replace(dots, centres=dots.centres + np.array([left, top]))


def measure(signal: Signal, above: FloatArray, threshold: float, area: float = 0.0) -> Dots:
    """Measure the components of a signal: centres, ellipses, noise.

    Parameters
    ----------
    signal : (H, W) int16
    above : (H, W) float
        The signal above its local background.
    threshold : float
    area : float [px^2]
        The usual one, if it is known.
    """
    labels, count = find_components(above, threshold, area)
    if not count:
        return no_dots()
    flat = np.flatnonzero(labels)
    owner = labels.ravel()[flat] - 1
    sizes = np.bincount(owner, minlength=count)
    least, most = _SMALLEST, signal.size // 50
    if area:
        least, most = max(least, int(area / _RANGE[0])), int(area * _RANGE[1]) + 1
    rows, columns = np.divmod(flat, signal.shape[1])
    x = np.bincount(owner, columns, count) / sizes
    y = np.bincount(owner, rows, count) / sizes
    dx, dy = columns - x[owner], rows - y[owner]
    xx, yy, xy = (np.bincount(owner, k, count) / sizes for k in (dx * dx, dy * dy, dx * dy))
    axes, _ = _ellipses(xx, yy, xy)
    # Lines and ragged components are left out.
    shaped = (axes[:, 1] > _SLIM * axes[:, 0]) & (sizes > _RAGGED * np.pi * axes.prod(axis=1))
    kept = np.flatnonzero((sizes >= least) & (sizes <= most) & shaped)
    if not len(kept) or len(kept) > _MOST:
        return no_dots()
    x, y = x[kept], y[kept]
    reach = np.sqrt(sizes[kept] / np.pi)
    # Ellipses reach farther than discs. A few sizes of windows, each measured at once.
    half = 3 * np.ceil((1.7 * reach + EDGE + 2) / 3).astype(int)
    parts = []
    for size in np.unique(half):
        these = half == size
        parts.append(_measured(signal, labels, kept[these] + 1, x[these], y[these], int(size)))
    return Dots(*(np.concatenate([getattr(p, n) for p in parts]) for n in Dots.__slots__))


def _measured(
    signal: Signal, labels: IntArray, own: IntArray, x: FloatArray, y: FloatArray, half: int
) -> Dots:
    """Measure components with windows of one size, all at once: (K, 2 half + 1, 2 half + 1)."""
    offsets = np.arange(-half, half + 1)
    column, row = np.rint(x).astype(int), np.rint(y).astype(int)
    rows, columns = row[:, None] + offsets, column[:, None] + offsets
    inside = ((rows >= 0) & (rows < signal.shape[0]))[:, :, None] & (
        (columns >= 0) & (columns < signal.shape[1])
    )[:, None]
    rows, columns = rows.clip(0, signal.shape[0] - 1), columns.clip(0, signal.shape[1] - 1)
    at = rows[:, :, None], columns[:, None]
    values, whose = signal[at].astype(np.float32), labels[at]
    mine = (whose == own[:, None, None]) & inside
    others = (whose > 0) & (whose != own[:, None, None])
    step = np.ones((1, 3, 3), dtype=bool)
    support = ndimage.binary_dilation(mine, step, EDGE) & inside
    support &= ~ndimage.binary_dilation(others, step)
    ring = ~ndimage.binary_dilation(mine, step, EDGE + 1) & ~others & inside
    base, noise = _ring_level(values, ring)
    height = np.maximum(_median(values, mine) - base, 1.0)
    span = (_PLATEAU - _FOOT) * height
    share = (values - (base + _FOOT * height)[:, None, None]) / span[:, None, None]
    share = np.where(support, share, 0.0).clip(0.0, 1.0).astype(np.float64)
    area = np.maximum(share.sum(axis=(1, 2)), 1e-6)
    dx, dy = offsets[None, None], offsets[None, :, None]
    mx, my = (share * dx).sum(axis=(1, 2)) / area, (share * dy).sum(axis=(1, 2)) / area
    ax, ay = dx - mx[:, None, None], dy - my[:, None, None]
    xx, yy, xy = ((share * k).sum(axis=(1, 2)) / area for k in (ax * ax, ay * ay, ax * ay))
    axes, angles = _ellipses(xx, yy, xy)
    # Only pixels between foot and plateau carry noise.
    noisy = (share > 0.0) & (share < 1.0)
    error = np.sqrt(0.5 * np.where(noisy, ax**2 + ay**2, 0.0).sum(axis=(1, 2)))
    return Dots(
        centres=np.stack([column + mx + 0.5, row + my + 0.5], axis=1),
        deviations=error * noise / span / area,
        axes=axes,
        angles=angles,
        areas=area,
        fills=area / (np.pi * axes[:, 0] * axes[:, 1]),
        heights=height,
        faint=np.zeros(len(own), dtype=bool),
    )


def _ring_level(values: NDArray[np.float32], ring: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Return median and noise (K,) of the surroundings of each dot."""
    # By differences of neighbours: a gradient of the light is no noise.
    steps = _median(np.abs(np.diff(values, axis=2)), ring[:, :, 1:] & ring[:, :, :-1])
    return _median(values, ring), np.maximum(
        MEDIAN_TO_DEVIATION / np.sqrt(2.0) * steps, _NOISE_FLOOR
    )


def _median(values: NDArray[np.float32], mine: BoolArray) -> FloatArray:
    """Return the median (K,) of the values of each window (K, H, W) that are `mine`; 0 of none."""
    # Sorted: numpy's median of those that are no NaN takes six times as long.
    ordered = np.sort(np.where(mine, values, np.inf).reshape(len(values), -1), axis=1)
    count, rows = mine.sum(axis=(1, 2)), np.arange(len(values))
    middle = ordered[rows, np.maximum(count - 1, 0) // 2] + ordered[rows, count // 2]
    return np.where(count > 0, middle / 2, 0.0)


def _ellipses(xx: FloatArray, yy: FloatArray, xy: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return half axes (K, 2) and angles (K,) of the ellipses with these second moments."""
    xx, yy = xx - _PIXEL_VARIANCE, yy - _PIXEL_VARIANCE
    middle, apart = (xx + yy) / 2, np.hypot((xx - yy) / 2, xy)
    values = np.maximum(np.stack([middle + apart, middle - apart], axis=1), 0.05)
    # A uniform ellipse has the variance a^2 / 4 along its half axis a.
    return 2.0 * np.sqrt(values), 0.5 * np.arctan2(2 * xy, xx - yy)
