"""Rule learning: for each emotion conjunctions of conditions that only its examples meet.

A rule is a conjunction of at most three conditions, `IS term` or `IS NOT term`, each of another
marker. The first is a term that no neutral face meets, so no rule fires at neutral. A rule is found
by a beam search that minimises

    mean over own examples (t - d)^2  +  mean and worst over the other emotions of the mean d^2
    + share of the mean and worst d^2 over movements that mean no emotion  +  noise

with d the firing strength and t the intensity of an example: every example also counts at lower
intensities, so that the right rule is strongest from the onset on. Every variant gets a rule,
unless earlier ones cover it. Examples without named variants are clustered
(`usdface.rule_learning.variants`) if separate rules cost less. Uncovered examples get another rule,
unless it is redundant (`usdface.rule_learning.redundancy`).
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.rule_learning.examples import Examples
from usdface.rule_learning.redundancy import subsumes
from usdface.rule_learning.terms import LinguisticTerms
from usdface.rule_learning.training_set import AMOUNTS, Conditions, TrainingSet
from usdface.rule_learning.variants import Grouping

__all__ = ["FALLBACK_WEIGHT", "LearnedRule", "choose_groupings", "learn_rules"]

_Cost = Callable[[FloatArray], FloatArray]

# Tuned by hand on benchmarks/fuzzy_variants.py (docs/constants.md). A quarter is exact in USD's
# float, so that a written system gives the same outputs to the last bit.
FALLBACK_WEIGHT = 0.25
# As many conditions as the paper's longest rule has (Zikky et al. 2013).
_CONDITIONS = 3
# Those that follow, up to _WORTHWHILE, were chosen by hand, no experiment (docs/constants.md).
# Rules for examples of one emotion that are not covered, beyond one rule for each variant.
_MOST_RULES = 3
# Cost of one variant more.
_PART_COST = 0.03
# Limit of time: width of the beam search.
_BEAM = 8
# Weights of the mean and of the worst firing on movements without emotion; those on examples and on
# other emotions weigh 1.
_MOVEMENTS = 0.5
_WORST_MOVEMENT = 0.3
# An additional condition has to take away this much of the cost, as a share and at all.
_LEAST_GAIN = (0.05, 0.01)
# Firing strength that covers an example; mean firing strength that covers a variant.
_COVERED = 0.5
_VARIANT_COVERED = 0.75
# A rule must do better than this share of the cost without it.
_WORTHWHILE = 0.9
# Numerical: costs are rounded, as the choice between mirrored markers must not hang on last bits.
_DIGITS = 6


@dataclass(frozen=True, slots=True)
class LearnedRule:
    """A conjunction of conditions that concludes with one emotion.

    Attributes
    ----------
    emotion : str
    conditions : tuple of (int, bool)
        Column of `LinguisticTerms`, and whether it is negated.
    fallback : bool
        Whether it is a rule of small weight for faces on which no other rule fires, see
        `usdface.rule_learning.fallback_rules`.
    """

    emotion: str
    conditions: Conditions
    fallback: bool = False

    @property
    def weight(self) -> float:
        """Of the rule in the rule base."""
        return FALLBACK_WEIGHT if self.fallback else 1.0


def choose_groupings(
    examples: Examples, terms: LinguisticTerms, groupings: dict[str, list[Grouping]]
) -> dict[str, Grouping]:
    """Choose for each emotion the grouping whose rules cost least.

    Parameters
    ----------
    examples : Examples
    terms : LinguisticTerms
        Of all groups, from `usdface.rule_learning.terms.linguistic_terms`.
    groupings : dict of str to list of Grouping
        Of `usdface.rule_learning.variants.variant_groupings`.
    """
    search = _Search(TrainingSet(examples, terms))

    def cost(emotion: str, parts: Grouping) -> float:
        costs = [search.best(emotion, part)[1] for part in parts]
        sizes = [part.sum() for part in parts]
        return float(np.average(costs, weights=sizes)) + _PART_COST * len(parts)

    return {
        e: min(of, key=partial(cost, e)) if len(of) > 1 else of[0] for e, of in groupings.items()
    }


def learn_rules(
    examples: Examples, terms: LinguisticTerms, groupings: dict[str, Grouping]
) -> list[LearnedRule]:
    """Learn the rules of every emotion that the examples show.

    An emotion gets none if no conjunction of terms costs less than no rule.

    Parameters
    ----------
    examples : Examples
    terms : LinguisticTerms
        Of all groups.
    groupings : dict of str to Grouping
        Of each emotion.
    """
    search = _Search(TrainingSet(examples, terms))
    return [
        LearnedRule(e, found)
        for e in examples.names
        for found in _rules_of(e, groupings[e], search)
    ]


def _rules_of(emotion: str, grouping: Grouping, search: "_Search") -> list[Conditions]:
    """Return the conditions of each rule of one emotion, none of them subsumed by another."""
    training = search.training
    examples = training.examples
    rules: list[Conditions] = []
    groups = list(grouping)
    remaining = len(groups) - 1 + _MOST_RULES
    met = np.zeros(len(examples.emotions))
    while groups and remaining:
        group = groups.pop(0)
        if met[group].mean() >= _VARIANT_COVERED:
            continue
        conditions, _ = search.best(emotion, group)
        if not conditions or any(subsumes(r, conditions, training.terms) for r in rules):
            continue
        remaining -= 1
        rules = [r for r in rules if not subsumes(conditions, r, training.terms)] + [conditions]
        met = np.maximum(met, training.firing(conditions) / examples.intensities)
        uncovered = group & (met < _COVERED)
        if uncovered.any() and uncovered.sum() < group.sum():
            groups.append(uncovered)
    return rules


class _Search:
    """Beam search for the conjunction that distinguishes some examples from all other faces."""

    def __init__(self, training: TrainingSet) -> None:
        self.training = training

    def best(self, emotion: str, group: BoolArray) -> tuple[Conditions, float]:
        """Return the conditions that distinguish some examples of an emotion, and their cost.

        No conditions where the cost without a rule is hardly larger.
        """
        intensities = self.training.intensities
        count = len(intensities)
        own = np.tile(group, len(AMOUNTS)) / (group.sum() * len(AMOUNTS))
        others = self._others(emotion)
        moves = count + np.flatnonzero(~self.training.similar(group))

        def cost(degree: FloatArray) -> FloatArray:
            total = own @ (intensities[:, None] - degree[:count]) ** 2
            if len(others):
                fired = others @ degree[:count] ** 2
                total += fired.mean(axis=0) + fired.max(axis=0)
            if len(moves):
                fired = degree[moves] ** 2
                total += _MOVEMENTS * fired.mean(axis=0) + _WORST_MOVEMENT * fired.max(axis=0)
            return np.asarray(np.round(total, _DIGITS))

        cost_without_rule = float(own @ intensities**2)
        chosen, least = self._search(cost)
        if least >= _WORTHWHILE * cost_without_rule:
            return (), cost_without_rule
        term_count = self.training.term_count
        return tuple((c % term_count, c >= term_count) for c in chosen), least

    def _others(self, emotion: str) -> FloatArray:
        """Return weights that average over the faces of each other emotion: (E - 1, faces)."""
        examples = self.training.examples
        rows = [np.tile(examples.rows(n), len(AMOUNTS)) for n in examples.names if n != emotion]
        return np.array([row / row.sum() for row in rows if row.any()])

    def _search(self, cost: _Cost) -> tuple[tuple[int, ...], float]:
        if not self.training.term_count:
            return (), np.inf
        least = np.inf
        best: tuple[int, ...] = ()
        beam: list[tuple[int, ...]] = [()]
        for _ in range(_CONDITIONS):
            # A conjunction is the same in any order.
            distinct = {frozenset(step[1]): step for c in beam for step in self._steps(c, cost)}
            found = sorted(distinct.values())
            share, gain = _LEAST_GAIN
            if not found or not found[0][0] < min((1 - share) * least, least - gain):
                break
            (least, best), beam = found[0], [chosen for _, chosen in found[:_BEAM]]
        return best, least

    def _steps(
        self, chosen: tuple[int, ...], cost: _Cost
    ) -> Iterator[tuple[float, tuple[int, ...]]]:
        """Yield the best conditions to add, with the cost of all."""
        training = self.training
        columns: IntArray = np.arange(len(training.marker))
        columns = columns[~np.isin(training.marker, training.marker[list(chosen)])]
        # The first condition is a term that no neutral face meets.
        columns = columns if chosen else columns[columns < training.term_count]
        degree = training.memberships[:, columns]
        noise = training.noise[columns]
        if chosen:
            degree = np.minimum(degree, training.memberships[:, chosen].min(axis=1)[:, None])
            noise = np.maximum(noise, training.noise[list(chosen)].max())
        total = np.round(cost(degree) + noise, _DIGITS)
        for i in np.argsort(total, kind="stable")[:_BEAM]:
            yield float(total[i]), (*chosen, int(columns[i]))
