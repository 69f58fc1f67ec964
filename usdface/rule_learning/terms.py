"""Linguistic terms of learned rules: up to three for each feature and direction.

Their tops are the minimum, the medium and the maximum of the feature over the emotions (and
their variants) that move it that way, the design rule of Zikky et al. 2013, section 4; a term
is a ramp from the end of a dead zone around neutral, so that a neutral face belongs to none.
All rules share the terms: `far_raised` of one marker means the same in each of them.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray, freeze
from usdface.fuzzy.variables import Term
from usdface.rule_design.marker_roles import degree_prefixes
from usdface.rule_learning.examples import Examples

__all__ = ["LinguisticTerms", "linguistic_terms"]

# In standard deviations of a feature's noise in a frame, of which smoothing over 0.15 s leaves a
# fifth at 60 frames a second and a quarter at 30: at least two and eight times the rest. The
# least signal was tuned by hand on benchmarks/fuzzy_variants.py, worlds 0 to 2 (docs/constants.md);
# those that follow it were chosen by hand, no experiment.
_DEAD_ZONE = 0.5
_LEAST_SIGNAL = 2.0
# A dead zone of at least this share of the top, for markers without noise.
_LEAST_DEAD_ZONE = 0.03
# Numerical guard for features without noise [face unit], half a micrometre.
_LEAST_MOTION = 1e-5
# The top is somewhat below the value that the term is made of: examples scatter.
_TOP = 0.95
# The value of an emotion is the lower quartile of its examples: three quarters of them reach it.
_QUANTILE = 0.25
# Terms whose tops are nearer than this factor are one.
_DISTINCT = 1.25


@dataclass(frozen=True, eq=False, slots=True)
class LinguisticTerms:
    """Terms of many features in one table.

    Attributes
    ----------
    feature : (T,) int64
        Column of `Examples.features`.
    foot, top : (T,) float64 [face unit]
        Membership 0 up to the foot, 1 from the top on; both have the term's sign.
    names : tuple of str, length T
    """

    feature: IntArray
    foot: FloatArray
    top: FloatArray
    names: tuple[str, ...]

    def __post_init__(self) -> None:
        freeze(self, "feature", dtype=np.int64)
        freeze(self, "foot", "top")

    def membership(self, features: FloatArray) -> FloatArray:
        """Return the membership of each row of `features` (P, I) in each term: (P, T)."""
        rise = (features[:, self.feature] - self.foot) / (self.top - self.foot)
        return np.where(np.isnan(rise), 0.0, np.clip(rise, 0.0, 1.0))

    def terms_of(self, feature: int, sign: int) -> tuple[Term, ...]:
        """Return the terms of one feature and direction, the nearest first."""
        at = np.flatnonzero((self.feature == feature) & (np.sign(self.top) == sign))
        return tuple(
            Term(self.names[i], "ramp", (float(self.foot[i]), float(self.top[i]))) for i in at
        )


def linguistic_terms(examples: Examples, groups: Sequence[BoolArray]) -> LinguisticTerms:
    """Return the terms of the examples; features that are occluded in one of them have none.

    Parameters
    ----------
    examples : Examples
    groups : sequence of (N,) bool
        Examples of each variant.
    """
    whole = examples.whole
    occluded = np.isnan(whole).any(axis=0)
    by_group = [np.where(occluded, 0.0, whole[group]) for group in groups]
    least = np.maximum(_LEAST_SIGNAL * examples.noise, _LEAST_MOTION)
    table: list[tuple[int, float, float, str]] = []
    for sign in (1, -1):
        reached = np.array([np.quantile(sign * rows, _QUANTILE, axis=0) for rows in by_group])
        reached = reached.reshape(-1, len(least))
        for feature in np.flatnonzero((reached > least).any(axis=0)):
            values = reached[reached[:, feature] > least[feature], feature]
            tops = _distinct(_TOP * np.array([values.min(), np.median(values), values.max()]))
            word = examples.direction_names[feature][sign > 0]
            for degree, top in zip(degree_prefixes(len(tops)), tops, strict=True):
                foot = max(_DEAD_ZONE * examples.noise[feature], _LEAST_DEAD_ZONE * top)
                table.append((int(feature), sign * foot, sign * top, degree + word))
    table.sort(key=lambda row: row[0])
    return LinguisticTerms(
        np.array([row[0] for row in table], dtype=np.int64),
        np.array([row[1] for row in table]),
        np.array([row[2] for row in table]),
        tuple(row[3] for row in table),
    )


def _distinct(tops: FloatArray) -> list[float]:
    """Return the ascending `tops` without near duplicates."""
    distinct: list[float] = []
    for top in tops.tolist():
        if not distinct or top > _DISTINCT * distinct[-1]:
            distinct.append(top)
    return distinct
