"""Defuzzification: one number for the set that the rules of a Mamdani system have cut out.

The set is sampled at points x_k of the output's range; mu_k is its membership there.

* centroid: sum x_k mu_k / sum mu_k
* bisector: where half of the area lies on either side, linear between samples
* mean_of_max, smallest_of_max, largest_of_max: of the points where mu is largest
"""

from collections.abc import Sequence

import numpy as np

from usdface.arrays import FloatArray
from usdface.fuzzy.membership import membership
from usdface.fuzzy.norms import AGGREGATIONS, T_NORMS
from usdface.fuzzy.system import FuzzySystem
from usdface.fuzzy.variables import Term, Variable

__all__ = ["defuzzify", "sample_points"]

# Values of a set, samples times frames, that are worked on at a time.
_BLOCK_VALUES = 1 << 16
# Memberships this close are equal: rounding of a cut and a flank.
_EQUAL = 1e-9


def sample_points(system: FuzzySystem, output: Variable) -> FloatArray:
    """Return the values of an output where its set is sampled: (K,), ascending."""
    (low, high), count = output.span, system.samples
    if system.sampling == "ends":
        return np.asarray(np.linspace(low, high, count))
    return np.asarray(low + (np.arange(count) + 0.5) * ((high - low) / count), dtype=np.float64)


def defuzzify(
    system: FuzzySystem, output: Variable, cuts: Sequence[tuple[FloatArray, Term]], frames: int
) -> FloatArray:
    """Join the cut terms of an output and defuzzify them.

    Parameters
    ----------
    system : FuzzySystem
        Its implication, aggregation, defuzzifier, samples and sampling are taken.
    output : Variable
    cuts : sequence of ((F,) float64, Term)
        Firing strength and the term that it cuts.
    frames : int
        F.

    Returns
    -------
    (F,) float64
        In the output's range; its default where the set is empty.
    """
    points = sample_points(system, output)
    imply, join = T_NORMS[system.implication], AGGREGATIONS[system.aggregation]
    answer = np.full(frames, output.default)
    shapes = [(f, membership(term.kind, term.parameters, points)[:, None]) for f, term in cuts]
    size = max(1, _BLOCK_VALUES // len(points))
    for begin in range(0, frames, size):
        block = slice(begin, begin + size)
        joined = np.zeros((len(points), len(answer[block])))
        for strength, shape in shapes:
            cut = np.broadcast_to(strength[block], joined.shape)
            joined = join(joined, imply(cut, np.broadcast_to(shape, joined.shape)))
        filled = joined.max(axis=0) > 0
        answer[block][filled] = np.clip(_number(system, points, joined[:, filled]), *output.span)
    return answer


def _number(system: FuzzySystem, points: FloatArray, joined: FloatArray) -> FloatArray:
    """Defuzzify sets (K, F) that are not empty."""
    if system.defuzzifier == "centroid":
        return _total(points[:, None] * joined) / _total(joined)
    if system.defuzzifier == "bisector":
        return _bisector(points, joined)
    largest = joined >= joined.max(axis=0) - _EQUAL
    if system.defuzzifier == "smallest_of_max":
        return np.asarray(points[np.argmax(largest, axis=0)])
    if system.defuzzifier == "largest_of_max":
        return np.asarray(points[len(points) - 1 - np.argmax(largest[::-1], axis=0)])
    return _total(largest * points[:, None]) / _total(largest.astype(np.float64))


def _total(values: FloatArray) -> FloatArray:
    """Sum over samples, added in order: numpy's own sum groups terms by the array's shape."""
    return np.asarray(np.cumsum(values, axis=0)[-1])


def _bisector(points: FloatArray, joined: FloatArray) -> FloatArray:
    """Return the x that halves the area; each sample fills the interval around its point."""
    area = np.cumsum(joined, axis=0, dtype=np.float64)
    half = 0.5 * area[-1]
    at = np.argmax(area >= half, axis=0)
    frame = np.arange(joined.shape[1])
    over = (area[at, frame] - half) / joined[at, frame]
    return np.asarray(points[at] + (points[1] - points[0]) * (0.5 - over), dtype=np.float64)
