"""The training set of rules: memberships of examples and movements in all terms."""

from functools import cached_property

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.rule_learning.examples import NO_EMOTION, Examples
from usdface.rule_learning.terms import LinguisticTerms

__all__ = ["AMOUNTS", "LEAST_SIGNAL", "Conditions", "TrainingSet"]

Conditions = tuple[tuple[int, bool], ...]

# Chosen by hand, no experiment (docs/constants.md).
# Intensities at which every example counts: a third, two thirds, the whole.
AMOUNTS = (0.35, 0.7, 1.0)
# Cost of a term whose ramp is as short as the noise of a frame.
_NOISE_COST = 0.1
# Cosine (features by their range) from which on a movement may well be the expression.
_ALIKE = 0.9
# It counts the features that move by more than this many deviations of their noise, as in
# `usdface.rule_design.feature_selection`.
LEAST_SIGNAL = 4.0


class TrainingSet:
    """Memberships of examples and movements in linguistic terms and in their negations.

    Attributes
    ----------
    examples : Examples
    terms : LinguisticTerms
    movements : (P, I) float64 [face unit]
        Without emotion: the movements of the examples, then also the examples without emotion.
    memberships : (A N + P, 2 T) float64
        Rows: the N examples at each of the A `AMOUNTS`, then `movements`. Columns: each term,
        then each negated.
    intensities : (A N,) float64
        Of each row of examples.
    marker : (2 T,) int64
        Index of the marker of each column.
    noise : (2 T,) float64
        Cost of each column's noise.
    """

    def __init__(self, examples: Examples, terms: LinguisticTerms) -> None:
        self.examples, self.terms = examples, terms
        none = np.nan_to_num(examples.features[examples.rows(NO_EMOTION)])
        self.movements: FloatArray = np.concatenate([examples.movements, none])
        faces = [amount * examples.features for amount in AMOUNTS]
        degree = terms.membership(np.concatenate([*faces, self.movements]))
        self.memberships: FloatArray = np.concatenate([degree, 1.0 - degree], axis=1)
        self.intensities: FloatArray = np.concatenate([a * examples.intensities for a in AMOUNTS])
        self.marker: IntArray = np.tile(terms.feature // 3, 2)
        noise = (examples.noise[terms.feature] / (terms.top - terms.foot)) ** 2
        self.noise: FloatArray = np.tile(_NOISE_COST * noise, 2)

    @property
    def term_count(self) -> int:
        """The number of terms: T."""
        return len(self.terms.names)

    @cached_property
    def whole(self) -> FloatArray:
        """The rows of `memberships` for the examples at their own intensity: (N, 2 T)."""
        count = len(self.examples.emotions)
        return self.memberships[(len(AMOUNTS) - 1) * count : len(AMOUNTS) * count]

    def columns(self, conditions: Conditions) -> list[int]:
        """Return the columns of `memberships` of some conditions."""
        return [term + self.term_count * negated for term, negated in conditions]

    def firing(self, conditions: Conditions) -> FloatArray:
        """Return the firing strength of a rule with these conditions on each example: (N,)."""
        return np.asarray(self.whole[:, self.columns(conditions)].min(axis=1))

    def similar(self, group: BoolArray) -> BoolArray:
        """Return which of `movements` resemble one of the group's examples: (P,) bool.

        Examples that are labelled as no emotion never do.
        """
        features = np.nan_to_num(self.examples.features)
        range_ = np.abs(features).max(axis=0)
        clear = range_ > LEAST_SIGNAL * self.examples.noise
        moves, own = (
            np.nan_to_num(f[:, clear]) / range_[clear] for f in (self.movements, features[group])
        )
        length = np.linalg.norm(moves, axis=1)[:, None] * np.linalg.norm(own, axis=1)
        alike = (moves @ own.T > _ALIKE * length).any(axis=1)
        alike[len(self.examples.movements) :] = False
        return np.asarray(alike)
