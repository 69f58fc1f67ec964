"""Learning rules: for each emotion the few conditions that its examples meet and no others do.

A rule is a conjunction of at most three conditions, `IS term` or `IS NOT term`, each of another
marker. The first asks for a term that no neutral face has, so no rule fires at neutral. It is
found by a beam search that minimises

    mean over own examples (t - d)^2  +  mean and worst over the other emotions of the mean d^2
    + share of the mean and worst d^2 over movements that mean no emotion  +  noise

with d the degree to which a face meets the conditions and t the intensity it shows: every
example also counts at lower intensities, so that the right rule leads from the onset on.
Every variant gets a rule, unless those before cover it. Where nobody named variants the examples
are parted (`usdface.rule_learning.variants`), as far as rules of their own cost less. What a rule
leaves uncovered gets one more, unless another says it already (`usdface.rule_learning.redundancy`).
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from usdface.rule_learning.examples import Examples
from usdface.rule_learning.redundancy import subsumes
from usdface.rule_learning.terms import Words
from usdface.rule_learning.training_set import AMOUNTS, Conditions, Faces
from usdface.rule_learning.variants import Parting
from usdface.takes import BoolArray, FloatArray, IntArray

__all__ = ["LearnedRule", "cheapest_partings", "learn_rules"]

_Cost = Callable[[FloatArray], FloatArray]

_CONDITIONS = 3
_MOST_RULES = 3  # for what one emotion leaves uncovered, beyond one for each variant
# Of one rule more.
_PART_COST = 0.03
_BEAM = 8
_OTHER_EMOTIONS = 1.0
_WORST_EMOTION = 1.0
_MOVEMENTS = 0.5
_WORST_MOVEMENT = 0.3
# An additional condition has to take away this much, as a share and at all.
_LEAST_GAIN = (0.05, 0.01)
# An example is covered by a rule that it meets this far; a variant, if its examples do on average.
_COVERED = 0.5
_VARIANT_COVERED = 0.75
# A rule must do better than this share of the cost of none.
_WORTHWHILE = 0.9
# Costs are rounded: which of two mirrored markers is taken must not hang on the last bits.
_DIGITS = 6


@dataclass(frozen=True, slots=True)
class LearnedRule:
    """One conjunction for one emotion: (column of `Words`, negated) for each condition."""

    emotion: str
    conditions: Conditions
    weight: float = 1.0


def cheapest_partings(
    examples: Examples, words: Words, ways: dict[str, list[Parting]]
) -> dict[str, Parting]:
    """Choose for each emotion the parting of which the rules cost least.

    Parameters
    ----------
    examples : Examples
    words : Words
        Made of all parts, with `usdface.rule_learning.terms.words_of`.
    ways : dict of str to list of Parting
        Of `usdface.rule_learning.variants.partings`.
    """
    search = _Search(Faces(examples, words))

    def cost(emotion: str, parts: Parting) -> float:
        costs = [search.best(emotion, part)[1] for part in parts]
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
    search = _Search(Faces(examples, words))
    return [LearnedRule(e, said) for e in examples.names for said in _rules_of(e, parts[e], search)]


def _rules_of(emotion: str, parts: Parting, search: "_Search") -> list[Conditions]:
    """Return the conditions of each rule of one emotion, none of them subsumed by another."""
    faces = search.faces
    examples = faces.examples
    rules: list[Conditions] = []
    waiting = list(parts)
    left = len(waiting) - 1 + _MOST_RULES
    met = np.zeros(len(examples.emotions))
    while waiting and left:
        group = waiting.pop(0)
        if met[group].mean() >= _VARIANT_COVERED:
            continue
        conditions, _ = search.best(emotion, group)
        if not conditions or any(subsumes(r, conditions, faces.words) for r in rules):
            continue
        left -= 1
        rules = [r for r in rules if not subsumes(conditions, r, faces.words)] + [conditions]
        met = np.maximum(met, faces.met(conditions) / examples.intensities)
        uncovered = group & (met < _COVERED)
        if uncovered.any() and uncovered.sum() < group.sum():
            waiting.append(uncovered)
    return rules


class _Search:
    """Looks for the conjunction that tells some examples from all other faces."""

    def __init__(self, faces: Faces) -> None:
        self.faces = faces

    def best(self, emotion: str, group: BoolArray) -> tuple[Conditions, float]:
        """Return the conditions that tell some examples of an emotion from all others; their cost.

        None where silence costs hardly more.
        """
        shown = self.faces.shown
        count = len(shown)
        own = np.tile(group, len(AMOUNTS)) / (group.sum() * len(AMOUNTS))
        others = self._others(emotion)
        moves = count + np.flatnonzero(~self.faces.alike(group))

        def cost(degree: FloatArray) -> FloatArray:
            total = own @ (shown[:, None] - degree[:count]) ** 2
            if len(others):
                fired = others @ degree[:count] ** 2
                total += _OTHER_EMOTIONS * fired.mean(axis=0) + _WORST_EMOTION * fired.max(axis=0)
            if len(moves):
                fired = degree[moves] ** 2
                total += _MOVEMENTS * fired.mean(axis=0) + _WORST_MOVEMENT * fired.max(axis=0)
            return np.asarray(np.round(total, _DIGITS))

        silence = float(own @ shown**2)
        chosen, least = self._search(cost)
        if least >= _WORTHWHILE * silence:
            return (), silence
        terms = self.faces.terms
        return tuple((c % terms, c >= terms) for c in chosen), least

    def _others(self, emotion: str) -> FloatArray:
        """Return weights that average over the faces of each other emotion: (E - 1, faces)."""
        examples = self.faces.examples
        rows = [np.tile(examples.rows(n), len(AMOUNTS)) for n in examples.names if n != emotion]
        return np.array([row / row.sum() for row in rows if row.any()])

    def _search(self, cost: _Cost) -> tuple[tuple[int, ...], float]:
        if not self.faces.terms:
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
        faces = self.faces
        columns: IntArray = np.arange(len(faces.marker))
        columns = columns[~np.isin(faces.marker, faces.marker[list(chosen)])]
        # One term that no neutral face has must be there; it comes first.
        columns = columns if chosen else columns[columns < faces.terms]
        degree = faces.degree[:, columns]
        noise = faces.noise[columns]
        if chosen:
            degree = np.minimum(degree, faces.degree[:, chosen].min(axis=1)[:, None])
            noise = np.maximum(noise, faces.noise[list(chosen)].max())
        total = np.round(cost(degree) + noise, _DIGITS)
        for i in np.argsort(total, kind="stable")[:_BEAM]:
            yield float(total[i]), (*chosen, int(columns[i]))
