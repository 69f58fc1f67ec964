"""Placement of labels beside points without overlaps."""

from collections.abc import Sequence

import numpy as np

from usdface.arrays import FloatArray

__all__ = ["label_places", "text_size"]

# Mean size of a glyph, as shares of the font size.
_WIDTH, _HEIGHT = 0.58, 1.15
# Distances of a label from its point that are tried, the nearest first [points].
_DISTANCES = (4.0, 9.0, 16.0, 26.0, 38.0)
_DIRECTIONS = 16
_ROUNDS = 4
# Overlap with labels or points [square points] that costs as much as one point of distance.
_COVERED = 0.5


def text_size(names: Sequence[str], font: float) -> FloatArray:
    """Return the approximate width and height of labels: (N, 2) [points]."""
    wide = [_WIDTH * font * len(name) for name in names]
    return np.column_stack([wide, np.full(len(names), _HEIGHT * font)])


def label_places(points: FloatArray, sizes: FloatArray, dot: float) -> FloatArray:
    """Return the centre of each point's label, (N, 2): near the point, with little overlap.

    Each label in turn moves to the candidate with the least overlap and distance, for a few rounds.

    Parameters
    ----------
    points, sizes : (N, 2) float64 [points]
        Positions of the points, width and height of their labels.
    dot : float [points]
        Diameter of a drawn point.
    """
    turns = 2 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    directions = np.column_stack([np.cos(turns), np.sin(turns)])
    distances = np.repeat(_DISTANCES, _DIRECTIONS)
    steps = np.tile(directions, (len(_DISTANCES), 1))
    # The box of a label touches the circle of its distance from outside.
    offsets = distances[:, None] * steps + (0.5 * sizes)[:, None] * np.clip(1.5 * steps, -1.0, 1.0)
    places = points + offsets[:, 0]
    dots = np.full_like(sizes, dot)
    for _ in range(_ROUNDS):
        for i in range(len(points)):
            candidates = points[i] + offsets[i]
            others = np.arange(len(points)) != i
            covered = _shared(candidates, sizes[i], places[others], sizes[others]).sum(axis=1)
            covered += _shared(candidates, sizes[i], points, dots).sum(axis=1)
            places[i] = candidates[np.argmin(distances + covered / _COVERED)]
    return np.asarray(places)


def _shared(
    centres: FloatArray, size: FloatArray, others: FloatArray, sizes: FloatArray
) -> FloatArray:
    """Return the area that boxes of one size share with other boxes: (C, N)."""
    apart = np.abs(centres[:, None] - others)
    shared = np.clip(0.5 * (size + sizes) - apart, 0.0, np.minimum(size, sizes))
    return np.asarray(shared.prod(axis=2))
