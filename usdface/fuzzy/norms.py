"""Norms, MOST OF and hedges: AND, OR, VERY, SOMEWHAT on degrees in [0, 1].

All are elementwise, so that a frame's answer does not depend on its neighbours. Norms after
Klement, Mesiar and Pap, "Triangular Norms", 2000; each s-norm is the dual of the t-norm in the
same row: s(a, b) = 1 - t(1 - a, 1 - b).
"""

from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np

from usdface.arrays import FloatArray, frozen

__all__ = ["AGGREGATIONS", "HEDGES", "S_NORMS", "T_NORMS", "most_of", "most_weights"]

Norm = Callable[[FloatArray, FloatArray], FloatArray]


def _lukasiewicz(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.maximum(a + b - 1.0, 0.0)


def _hamacher(a: FloatArray, b: FloatArray) -> FloatArray:
    both = a + b - a * b
    return np.divide(a * b, both, out=np.zeros_like(both), where=both > 0)


def _einstein(a: FloatArray, b: FloatArray) -> FloatArray:
    return a * b / (2.0 - (a + b - a * b))


def _drastic(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.where(np.maximum(a, b) == 1.0, np.minimum(a, b), 0.0)


def _nilpotent(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.where(a + b > 1.0, np.minimum(a, b), 0.0)


def _algebraic_sum(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.minimum(a + b - a * b, 1.0)  # as the next two, a bit above by rounding


def _lukasiewicz_sum(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.minimum(a + b, 1.0)


def _hamacher_sum(a: FloatArray, b: FloatArray) -> FloatArray:
    rest = 1.0 - a * b
    joined = np.divide(a + b - 2.0 * a * b, rest, out=np.ones_like(rest), where=rest > 0)
    return np.minimum(joined, 1.0)


def _einstein_sum(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.minimum((a + b) / (1.0 + a * b), 1.0)


def _drastic_sum(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.where(np.minimum(a, b) == 0.0, np.maximum(a, b), 1.0)


def _nilpotent_sum(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.where(a + b < 1.0, np.maximum(a, b), 1.0)


T_NORMS: dict[str, Norm] = {
    "min": np.minimum,
    "prod": np.multiply,
    "lukasiewicz": _lukasiewicz,
    "hamacher": _hamacher,
    "einstein": _einstein,
    "drastic": _drastic,
    "nilpotent": _nilpotent,
}
S_NORMS: dict[str, Norm] = {
    "max": np.maximum,
    "probor": _algebraic_sum,
    "lukasiewicz": _lukasiewicz_sum,
    "hamacher": _hamacher_sum,
    "einstein": _einstein_sum,
    "drastic": _drastic_sum,
    "nilpotent": _nilpotent_sum,
}
# Mamdani sets may also be added without bound.
AGGREGATIONS: dict[str, Norm] = S_NORMS | {"sum": np.add}

# MOST OF begins where more than the first share of the conditions hold, and is 1 from the second
# on. Zadeh's "most" of the literature begins at 0.3; with it rules detect more, right and wrong
# (docs/constants.md).
_MOST = (0.4, 0.8)


@lru_cache(maxsize=64)
def most_weights(count: int) -> FloatArray:
    """Return the weights of MOST OF for degrees from the largest to the smallest: (count,).

    They add up to 1.
    """
    begins, whole = _MOST
    quantifier = np.clip((np.arange(count + 1) / count - begins) / (whole - begins), 0.0, 1.0)
    return frozen(np.diff(quantifier))


def most_of(degrees: Sequence[FloatArray]) -> FloatArray:
    """Return how far most of the conditions hold: an ordered weighted average, (F,).

    R. Yager, "On ordered weighted averaging aggregation operators in multicriteria
    decisionmaking", 1988: the k-th largest degree counts Q(k/n) - Q((k - 1)/n), with Q the
    quantifier. Of conditions that all hold to the same degree it is that degree; one of five that
    does not hold at all changes nothing.

    Parameters
    ----------
    degrees : sequence of (F,) float64
    """
    ordered = np.sort(np.array(degrees), axis=0)[::-1]
    total = np.zeros(ordered.shape[1:])
    # Added in order: a product of matrices groups terms by the array's size.
    for weight, row in zip(most_weights(len(ordered)), ordered, strict=True):
        if weight:
            total += weight * row
    return total


def _extremely(x: FloatArray) -> FloatArray:
    return np.where(x <= 0.5, 2.0 * x * x, 1.0 - 2.0 * (1.0 - x) * (1.0 - x))


def _seldom(x: FloatArray) -> FloatArray:
    return np.where(x <= 0.5, np.sqrt(0.5 * x), 1.0 - np.sqrt(0.5 * (1.0 - x)))


# Zadeh, "A fuzzy-set-theoretic interpretation of linguistic hedges", 1972: concentration,
# dilation, contrast intensification and its inverse.
HEDGES: dict[str, Callable[[FloatArray], FloatArray]] = {
    "not": lambda x: 1.0 - x,
    "very": lambda x: x * x,
    "somewhat": np.sqrt,
    "extremely": _extremely,
    "seldom": _seldom,
}
