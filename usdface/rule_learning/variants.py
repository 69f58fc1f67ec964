"""Ways to part an emotion's examples into variants: as they are named, or as they lie together."""

import numpy as np
from scipy.cluster.hierarchy import linkage

from usdface.rule_learning.clusters import clusters
from usdface.rule_learning.examples import Examples
from usdface.takes import BoolArray

__all__ = ["Parting", "partings"]

Parting = list[BoolArray]

_MOST_PARTS = 3
_LEAST_NOISE = 1e-6


def partings(examples: Examples) -> dict[str, list[Parting]]:
    """Return for each emotion the ways to part its examples, each a list of rows (N,) bool.

    One way where variants are named. Otherwise one, two and three groups of examples that lie
    together, their distance measured in the noise of each feature (J. H. Ward, "Hierarchical
    Grouping to Optimize an Objective Function", 1963). The largest group comes first.
    """
    return {emotion: _partings_of(emotion, examples) for emotion in examples.names}


def _partings_of(emotion: str, examples: Examples) -> list[Parting]:
    named = [examples.rows(emotion, v) for v in examples.variants_of(emotion)]
    own = np.flatnonzero(examples.rows(emotion))
    if len(named) > 1 or len(own) < 2:
        return [named]
    scaled = examples.whole[own] / np.maximum(examples.noise, _LEAST_NOISE)
    tree = linkage(np.nan_to_num(scaled), "ward")
    found: list[Parting] = []
    for count in range(1, min(_MOST_PARTS, len(own)) + 1):
        of = clusters(tree, count)
        parts = [np.isin(np.arange(len(named[0])), own[of == i]) for i in np.unique(of)]
        found.append(sorted(parts, key=lambda part: (-part.sum(), part.argmax())))
    return found
