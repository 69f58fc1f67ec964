"""Learning rules: for each emotion the few conditions that its examples meet and no others do.

A rule is a conjunction of at most three conditions, `IS term` or `IS NOT term`, each of another
marker. The first asks for a term that no neutral face has, so no rule fires at neutral. It is
found by a beam search that minimises

    mean over own examples (t - d)^2  +  mean and worst over the other emotions of the mean d^2
    + share of the mean and worst d^2 over movements that mean no emotion  +  noise

with d the degree to which a face meets the conditions and t the intensity it shows: every
example also counts at lower intensities, so that the right rule leads from the onset on.
Every variant gets a rule, unless those before cover it. Where nobody named variants the examples
are parted (`usdface.fuzzy.fit_parts`), as far as rules of their own cost less. What a rule leaves
uncovered gets one more.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from usdface.fuzzy.fit_examples import NO_EMOTION, Examples
from usdface.fuzzy.fit_parts import Parting
from usdface.fuzzy.fit_terms import Words
from usdface.takes import BoolArray, FloatArray, IntArray

__all__ = ["LearnedRule", "cheapest_partings", "learn_rules"]

_Cost = Callable[[FloatArray], FloatArray]

_CONDITIONS = 3
_MOST_RULES = 3  # for what one emotion leaves uncovered, beyond one for each variant
# Of one rule more.
_PART_COST = 0.03
_BEAM = 8
# Intensities at which every example counts.
_AMOUNTS = (0.35, 0.7, 1.0)
_OTHER_EMOTIONS = 1.0
_WORST_EMOTION = 1.0
_MOVEMENTS = 0.5
_WORST_MOVEMENT = 0.3
# Cost of a term whose ramp is as short as the noise.
_NOISE_COST = 0.5
# An additional condition has to take away this much, as a share and at all.
_LEAST_GAIN = (0.05, 0.01)
# An example is covered by a rule that it meets this far; a variant, if its examples do on average.
_COVERED = 0.5
_VARIANT_COVERED = 0.75
# A rule must do better than this share of the cost of none.
_WORTHWHILE = 0.9
# A movement this like an example (cosine, every feature by its range) may well be the expression.
_ALIKE = 0.9
# ... where features count that move by more than so many deviations of their noise.
_LEAST_SIGNAL = 4.0
# Costs are rounded: which of two mirrored markers is taken must not hang on the last bits.
_DIGITS = 6


@dataclass(frozen=True, slots=True)
class LearnedRule:
    """One conjunction for one emotion: (column of `Words`, negated) for each condition."""

    emotion: str
    conditions: tuple[tuple[int, bool], ...]


def cheapest_partings(
    examples: Examples, words: Words, ways: dict[str, list[Parting]]
) -> dict[str, Parting]:
    """Choose for each emotion the parting of which the rules cost least.

    Parameters
    ----------
    examples : Examples
    words : Words
        Made of all parts, with `usdface.fuzzy.fit_terms.words_of`.
    ways : dict of str to list of Parting
        Of `usdface.fuzzy.fit_parts.partings`.
    """
    faces = _Faces(examples, words)

    def cost(emotion: str, parts: Parting) -> float:
        costs = [faces.best(emotion, part)[1] for part in parts]
        sizes = [part.sum() for part in parts]
        return float(np.average(costs, weights=sizes)) + _PART_COST * len(parts)

    return {e: min(of, key=partial(cost, e)) if len(of) > 1 else of[0] for e, of in ways.items()}


def learn_rules(examples: Examples, words: Words, parts: dict[str, Parting]) -> list[LearnedRule]:
    """Learn the rules of every emotion that the examples show.

    An emotion that no conjunction of terms shows better than silence gets none.

    Parameters
    ----------
    examples : Examples
    words : Words
        Made of the parts.
    parts : dict of str to Parting
        Of each emotion.
    """
    faces = _Faces(examples, words)
    return [rule for e in examples.names for rule in _rules_of(e, examples, parts[e], faces)]


def _rules_of(
    emotion: str, examples: Examples, parts: Parting, faces: "_Faces"
) -> Iterator[LearnedRule]:
    waiting = list(parts)
    left = len(waiting) - 1 + _MOST_RULES
    met = np.zeros(len(examples.emotions))
    while waiting and left:
        group = waiting.pop(0)
        if met[group].mean() >= _VARIANT_COVERED:
            continue
        conditions, _ = faces.best(emotion, group)
        if not conditions:
            continue
        left -= 1
        yield LearnedRule(emotion, conditions)
        met = np.maximum(met, faces.met(conditions) / examples.intensities)
        uncovered = group & (met < _COVERED)
        if uncovered.any() and uncovered.sum() < group.sum():
            waiting.append(uncovered)


class _Faces:
    """How far all faces that rules are learned from meet all conditions.

    Rows: the examples at each of `_AMOUNTS`, then what means no emotion: movements, and once
    more the examples of none. Columns: each term, then each negated.
    """

    def __init__(self, examples: Examples, words: Words) -> None:
        self._examples = examples
        silent = np.nan_to_num(examples.features[examples.rows(NO_EMOTION)])
        self._movements = np.concatenate([examples.movements, silent])
        self._count = len(examples.emotions)
        self._terms = len(words.names)
        whole = examples.features
        faces = [amount * whole for amount in _AMOUNTS]
        degree = words.degrees(np.concatenate([*faces, self._movements]))
        self._degree = np.concatenate([degree, 1.0 - degree], axis=1)
        self._shown = np.concatenate([a * examples.intensities for a in _AMOUNTS])
        self._marker = np.tile(words.feature // 3, 2)
        noise = (examples.noise[words.feature] / (words.top - words.foot)) ** 2
        self._noise = np.tile(_NOISE_COST * noise, 2)

    def met(self, conditions: tuple[tuple[int, bool], ...]) -> FloatArray:
        """Return how far each example meets the conditions: (N,)."""
        columns = [term + self._terms * negated for term, negated in conditions]
        whole = slice((len(_AMOUNTS) - 1) * self._count, len(_AMOUNTS) * self._count)
        return np.asarray(self._degree[whole, columns].min(axis=1))

    def best(self, emotion: str, group: BoolArray) -> tuple[tuple[tuple[int, bool], ...], float]:
        """Return the conditions that tell some examples of an emotion from all others; their cost.

        None where silence costs hardly more.
        """
        faces = len(_AMOUNTS) * self._count
        own = np.tile(group, len(_AMOUNTS)) / (group.sum() * len(_AMOUNTS))
        others = self._others(emotion)
        moves = faces + np.flatnonzero(~self._alike(group))

        def cost(degree: FloatArray) -> FloatArray:
            total = own @ (self._shown[:, None] - degree[:faces]) ** 2
            if len(others):
                fired = others @ degree[:faces] ** 2
                total += _OTHER_EMOTIONS * fired.mean(axis=0) + _WORST_EMOTION * fired.max(axis=0)
            if len(moves):
                fired = degree[moves] ** 2
                total += _MOVEMENTS * fired.mean(axis=0) + _WORST_MOVEMENT * fired.max(axis=0)
            return np.asarray(np.round(total, _DIGITS))

        silence = float(own @ self._shown**2)
        chosen, least = self._search(cost)
        if least >= _WORTHWHILE * silence:
            return (), silence
        return tuple((c % self._terms, c >= self._terms) for c in chosen), least

    def _others(self, emotion: str) -> FloatArray:
        """Return weights that average over the faces of each other emotion: (E - 1, faces)."""
        names = [n for n in self._examples.names if n != emotion]
        rows = [np.tile(self._examples.rows(name), len(_AMOUNTS)) for name in names]
        return np.array([row / row.sum() for row in rows if row.any()])

    def _alike(self, group: BoolArray) -> BoolArray:
        """Return which movements look like one of the group's examples: (P,) bool.

        What the labels say to be no emotion never does.
        """
        features = np.nan_to_num(self._examples.features)
        range_ = np.abs(features).max(axis=0)
        seen = range_ > _LEAST_SIGNAL * self._examples.noise
        moves, own = (
            np.nan_to_num(f[:, seen]) / range_[seen] for f in (self._movements, features[group])
        )
        length = np.linalg.norm(moves, axis=1)[:, None] * np.linalg.norm(own, axis=1)
        alike = (moves @ own.T > _ALIKE * length).any(axis=1)
        alike[len(self._examples.movements) :] = False
        return np.asarray(alike)

    def _search(self, cost: _Cost) -> tuple[tuple[int, ...], float]:
        if not self._terms:
            return (), np.inf
        least = np.inf
        best: tuple[int, ...] = ()
        beam: list[tuple[int, ...]] = [()]
        for _ in range(_CONDITIONS):
            # A conjunction is the same in any order.
            ways = {frozenset(step[1]): step for c in beam for step in self._steps(c, cost)}
            found = sorted(ways.values())
            share, gain = _LEAST_GAIN
            if not found or not found[0][0] < min((1 - share) * least, least - gain):
                break
            (least, best), beam = found[0], [chosen for _, chosen in found[:_BEAM]]
        return best, least

    def _steps(
        self, chosen: tuple[int, ...], cost: _Cost
    ) -> Iterator[tuple[float, tuple[int, ...]]]:
        """Yield the best conditions to add, with the cost of all."""
        columns: IntArray = np.arange(len(self._marker))
        columns = columns[~np.isin(self._marker, self._marker[list(chosen)])]
        # One term that no neutral face has must be there; it comes first.
        columns = columns if chosen else columns[columns < self._terms]
        degree = self._degree[:, columns]
        noise = self._noise[columns]
        if chosen:
            degree = np.minimum(degree, self._degree[:, chosen].min(axis=1)[:, None])
            noise = np.maximum(noise, self._noise[list(chosen)].max())
        total = np.round(cost(degree) + noise, _DIGITS)
        for i in np.argsort(total, kind="stable")[:_BEAM]:
            yield float(total[i]), (*chosen, int(columns[i]))
