"""Connected components of an image's signal: each dot one, however faint or near to another."""

import numpy as np
from scipy import ndimage

from usdface.arrays import BoolArray, FloatArray, IntArray

__all__ = ["EDGE", "find_components"]

# Pixels around a component's half height: its blurred edge lies there, and colour that JPEG spread.
EDGE = 3
_HALF = 0.45  # threshold of a dot, of its own height
# A dot below the second multiple of the threshold is segmented at the first.
_FAINT = (0.5, 2.2)
# A component of so many usual areas is split at these shares of its height, if pieces of this share
# of the usual area are left.
_LARGE, _CUTS_APART, _PIECE = 1.4, (0.6, 0.75), 0.2
# 8-connected: a dot at the face's edge is a slanted line of pixels.
_NEIGHBOURS = np.ones((3, 3), dtype=bool)


def find_components(above: FloatArray, threshold: float, area: float) -> tuple[IntArray, int]:
    """Label components above a threshold, and then above half of their own height.

    So a dot in the shade is as large as one in the light, and does not merge with another coloured
    component. Where the area of a dot is known, faint ones are segmented at a lower threshold, and
    two that merge at a higher one.

    Parameters
    ----------
    above : (H, W) float
        A signal above its local background.
    threshold : float
        In units of the signal.
    area : float [px^2]
        The usual area of a dot; 0 = not known.

    Returns
    -------
    labels : (H, W) int
        0 = background, else the number of the component, from 1 on.
    count : int
    """
    labels, count = ndimage.label(above > threshold, _NEIGHBOURS)
    if not count:
        return labels, 0
    peaks = _peaks(above, labels, count)
    faint = peaks < _FAINT[1] * threshold
    if area and faint.any():
        labels, count = _cut_out_lower(above, labels, faint, _FAINT[0] * threshold)
        peaks = _peaks(above, labels, count)
    flat = np.flatnonzero(labels)
    owner = labels.ravel()[flat]
    labels.ravel()[flat[above.ravel()[flat] < _HALF * peaks[owner - 1]]] = 0
    whole: tuple[IntArray, int] = ndimage.label(labels, _NEIGHBOURS)
    return _cut_apart(above, *whole, area) if area else whole


def _cut_out_lower(
    above: FloatArray, labels: IntArray, faint: BoolArray, threshold: float
) -> tuple[IntArray, int]:
    """Segment the faint components at a lower threshold, where no other is near."""
    count = len(faint)
    others = np.concatenate([[False], ~faint])[labels]
    near = ndimage.maximum_filter(others.view(np.uint8), 2 * EDGE + 1, mode="constant")
    lower, number = ndimage.label((above > threshold) & (near == 0), _NEIGHBOURS)
    seeded = np.bincount(lower[labels > 0], minlength=number + 1) > 0
    seeded[0] = False
    return np.where(seeded[lower], lower + count, np.where(others, labels, 0)), count + number


def _peaks(above: FloatArray, labels: IntArray, count: int) -> FloatArray:
    """Return the height (count,) of each component: its 75th percentile, robust to noise."""
    flat = np.flatnonzero(labels)
    owner, heights = labels.ravel()[flat] - 1, above.ravel()[flat]
    order = np.lexsort((heights, owner))
    ends = np.searchsorted(owner[order], np.arange(count), side="right") - 1
    sizes = np.bincount(owner, minlength=count)
    return np.where(sizes > 0, heights[order[ends - sizes // 4]], 0.0)


def _cut_apart(
    above: FloatArray, labels: IntArray, count: int, area: float
) -> tuple[IntArray, int]:
    """Split the components that are larger than a dot and are several above a share of height."""
    large = np.bincount(labels.ravel(), minlength=count + 1)[1:] > _LARGE * area
    if not large.any():
        return labels, count
    windows = ndimage.find_objects(labels)
    for own in (np.flatnonzero(large) + 1).tolist():
        window = windows[own - 1]
        mine, heights = labels[window] == own, above[window]
        peak = float(np.percentile(heights[mine], 75))
        for cut in _CUTS_APART:
            pieces, number = ndimage.label(mine & (heights > cut * peak), _NEIGHBOURS)
            sizes = np.bincount(pieces.ravel(), minlength=number + 1)[1:]
            whole = np.flatnonzero(sizes > _PIECE * area) + 1
            if len(whole) > 1:
                labels[window][mine] = 0
                numbers = own, *range(count + 1, count + len(whole))
                for name, piece in zip(numbers, whole.tolist(), strict=True):
                    labels[window][pieces == piece] = name
                count += len(whole) - 1
                break
    return labels, count
