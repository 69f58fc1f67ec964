"""How far the faces that rules are learned from meet the conditions that rules may ask for."""

from functools import cached_property

import numpy as np

from usdface.rule_learning.examples import NO_EMOTION, Examples
from usdface.rule_learning.terms import Words
from usdface.takes import BoolArray, FloatArray, IntArray

__all__ = ["AMOUNTS", "Conditions", "Faces"]

Conditions = tuple[tuple[int, bool], ...]

# Intensities at which every example counts.
AMOUNTS = (0.35, 0.7, 1.0)
# Cost of a term whose ramp is as short as the noise of a frame.
_NOISE_COST = 0.1
# A movement this like an example (cosine, every feature by its range) may well be the expression.
_ALIKE = 0.9
# ... where features count that move by more than so many deviations of their noise.
_LEAST_SIGNAL = 4.0


class Faces:
    """Examples and movements, by the terms of `Words` and by their negations.

    Attributes
    ----------
    examples : Examples
    words : Words
    movements : (P, I) float64 [face unit]
        What means no emotion: movements, then once more the examples of none.
    degree : (A N + P, 2 T) float64
        Rows: the N examples at each of the A `AMOUNTS`, then `movements`. Columns: each term,
        then each negated.
    shown : (A N,) float64
        The intensity that each row of examples shows.
    marker : (2 T,) int64
        Which marker each column is about.
    noise : (2 T,) float64
        Cost of each column's noise.
    """

    def __init__(self, examples: Examples, words: Words) -> None:
        self.examples, self.words = examples, words
        silent = np.nan_to_num(examples.features[examples.rows(NO_EMOTION)])
        self.movements: FloatArray = np.concatenate([examples.movements, silent])
        faces = [amount * examples.features for amount in AMOUNTS]
        degree = words.degrees(np.concatenate([*faces, self.movements]))
        self.degree: FloatArray = np.concatenate([degree, 1.0 - degree], axis=1)
        self.shown: FloatArray = np.concatenate([a * examples.intensities for a in AMOUNTS])
        self.marker: IntArray = np.tile(words.feature // 3, 2)
        noise = (examples.noise[words.feature] / (words.top - words.foot)) ** 2
        self.noise: FloatArray = np.tile(_NOISE_COST * noise, 2)

    @property
    def terms(self) -> int:
        """How many terms there are: T."""
        return len(self.words.names)

    @cached_property
    def whole(self) -> FloatArray:
        """The rows of `degree` for the examples as they are: (N, 2 T)."""
        count = len(self.examples.emotions)
        return self.degree[(len(AMOUNTS) - 1) * count : len(AMOUNTS) * count]

    def columns(self, conditions: Conditions) -> list[int]:
        """Return the columns of `degree` that conditions ask for."""
        return [term + self.terms * negated for term, negated in conditions]

    def met(self, conditions: Conditions) -> FloatArray:
        """Return how far each example meets the conditions: (N,)."""
        return np.asarray(self.whole[:, self.columns(conditions)].min(axis=1))

    def alike(self, group: BoolArray) -> BoolArray:
        """Return which of `movements` look like one of the group's examples: (P,) bool.

        What the labels say to be no emotion never does.
        """
        features = np.nan_to_num(self.examples.features)
        range_ = np.abs(features).max(axis=0)
        seen = range_ > _LEAST_SIGNAL * self.examples.noise
        moves, own = (
            np.nan_to_num(f[:, seen]) / range_[seen] for f in (self.movements, features[group])
        )
        length = np.linalg.norm(moves, axis=1)[:, None] * np.linalg.norm(own, axis=1)
        alike = (moves @ own.T > _ALIKE * length).any(axis=1)
        alike[len(self.examples.movements) :] = False
        return np.asarray(alike)
