"""Variants of an emotion: as the labels name them, or as clusters of its examples."""

import numpy as np
from scipy.cluster.hierarchy import linkage

from usdface.arrays import BoolArray
from usdface.rule_learning.clusters import clusters
from usdface.rule_learning.examples import Examples

__all__ = ["Grouping", "variant_groupings"]

# Rows (N,) bool of each variant of one emotion.
Grouping = list[BoolArray]

# Most variants of an emotion without named variants; chosen by hand, no experiment.
_MOST_PARTS = 3
# Numerical guard for markers without noise [face unit].
_LEAST_NOISE = 1e-6


def variant_groupings(examples: Examples) -> dict[str, list[Grouping]]:
    """Return candidate groupings of each emotion's examples into variants.

    One where the labels name variants. Otherwise one, two and three clusters of examples, their
    distance measured in the noise of each feature (J. H. Ward, "Hierarchical Grouping to Optimize
    an Objective Function", 1963). The largest cluster comes first.
    """
    return {emotion: _groupings_of(emotion, examples) for emotion in examples.names}


def _groupings_of(emotion: str, examples: Examples) -> list[Grouping]:
    named = [examples.rows(emotion, v) for v in examples.variants_of(emotion)]
    own = np.flatnonzero(examples.rows(emotion))
    if len(named) > 1 or len(own) < 2:
        return [named]
    scaled = examples.whole[own] / np.maximum(examples.noise, _LEAST_NOISE)
    tree = linkage(np.nan_to_num(scaled), "ward")
    found: list[Grouping] = []
    for count in range(1, min(_MOST_PARTS, len(own)) + 1):
        of = clusters(tree, count)
        parts = [np.isin(np.arange(len(named[0])), own[of == i]) for i in np.unique(of)]
        found.append(sorted(parts, key=lambda part: (-part.sum(), part.argmax())))
    return found
