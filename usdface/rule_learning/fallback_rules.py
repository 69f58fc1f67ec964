"""Fallback rules: short rules of little weight, for faces on which no other learned rule fires.

The antecedent of a learned rule has everything that distinguishes its variant from all others, so
the rule does not fire where a part of the expression is missing, in another variant of the emotion
or in another person. Fallback rules have one or two conditions and are learned from faces without
one of their parts. Their weight is small: they decide only where no other rule fires.

Parts are features that move together over all examples and movements (average linkage of the
cosines of their motions). Fallback rules are added one at a time, each the one that most lowers

    mean of sum_e (output_e - intensity_e)^2 over faces, whole and each without one of its parts

of the rule base as it stands, with a price for every condition; every emotion, and no emotion,
weighs the same in the mean. This is stagewise fitting (J. Friedman, "Greedy Function Approximation:
A Gradient Boosting Machine", 2001) with rules for learners.
"""

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np
from scipy.cluster.hierarchy import linkage
from scipy.spatial.distance import squareform

from usdface.arrays import FloatArray, IntArray
from usdface.rule_learning.clusters import clusters
from usdface.rule_learning.examples import NO_EMOTION, Examples
from usdface.rule_learning.redundancy import subsumes
from usdface.rule_learning.rules import FALLBACK_WEIGHT, LearnedRule
from usdface.rule_learning.terms import LinguisticTerms
from usdface.rule_learning.training_set import AMOUNTS, LEAST_SIGNAL, Conditions, TrainingSet

__all__ = ["learn_fallback_rules"]

# All but the limits of time and the rounding were tuned by hand on worlds 0 to 2 of
# benchmarks/fuzzy_variants.py, which judges them (docs/constants.md).
# Fallback rules of one emotion, and parts of a face.
_MOST_RULES = 3
_PARTS = 6
# Share of the weight of whole faces that goes to the same faces without a part.
_PARTIAL = 0.5
# Membership in some term from which on a part counts as moved, and the rest of a face as enough.
_MOVED = 0.25
# Weight of movements without emotion, when each emotion weighs 1.
_MOVEMENTS = 0.3
# Largest outputs that fallback rules may give a face without emotion, and a single movement,
# beyond those of the other rules.
_LARGEST_NONE, _LARGEST_MOVEMENT = 0.05, 0.2
# Price of a condition, and of one that is as small as its noise: without them, rules are added that
# only fit the scatter of the examples.
_CONDITION_COST = 0.002
_NOISE_COST = 0.02
# Terms that fallback rules of one emotion may require, and terms of others that they may negate.
_OWN, _OTHERS = 8, 6
# Least mean membership of an emotion's examples in a term that its rules require.
_LEAST_MET = 0.15
# Of terms whose memberships correlate more than this, one is enough.
_TOGETHER = 0.95
# Limit of time: candidates of each emotion that are tried again after each rule.
_SHORTLIST = 20
# Numerical: costs are rounded, as the choice between mirrored markers must not hang on last bits.
_DIGITS = 6


def learn_fallback_rules(
    examples: Examples, terms: LinguisticTerms, rules: Sequence[LearnedRule]
) -> list[LearnedRule]:
    """Learn rules for faces that meet the antecedents of the other rules only in part.

    Parameters
    ----------
    examples : Examples
    terms : LinguisticTerms
    rules : sequence of LearnedRule
        Of `usdface.rule_learning.rules.learn_rules`, with these terms.

    Returns
    -------
    list of LearnedRule
        In the order of the emotions; none is subsumed by another rule.
    """
    training = TrainingSet(examples, terms)
    if not training.term_count:
        return []
    names = examples.names
    fit = _Fit(training)
    for rule in rules:
        fit.add(names.index(rule.emotion), rule.conditions, rule.weight)
    known_rules = {
        e: [r.conditions for r in rules if r.emotion == name] for e, name in enumerate(names)
    }
    candidates = [
        (emotion, conditions)
        for emotion in range(len(names))
        for conditions in fit.shortlist(emotion, list(_candidates(emotion, training)))
    ]
    fallback: list[tuple[int, Conditions]] = []
    while candidates:
        candidates = [
            (e, c)
            for e, c in candidates
            if not any(subsumes(known, c, terms) for known in known_rules[e])
            and not any(subsumes(c, known, terms) for of, known in fallback if of == e)
        ]
        costs = fit.costs(candidates)
        if not len(costs) or costs.min() >= fit.cost:
            break
        best = candidates[int(np.argmin(costs))]
        fit.add(*best, FALLBACK_WEIGHT)
        fallback.append(best)
        known_rules[best[0]].append(best[1])
        full = sum(e == best[0] for e, _ in fallback) >= _MOST_RULES
        candidates = [(e, c) for e, c in candidates if not (full and e == best[0])]
    fallback.sort(key=lambda rule: rule[0])
    return [LearnedRule(names[e], conditions, fallback=True) for e, conditions in fallback]


class _Fit:
    """Outputs of the rules so far, on whole faces and on faces without a part, and their cost."""

    def __init__(self, training: TrainingSet) -> None:
        self._training = training
        examples = training.examples
        names = (*examples.names, NO_EMOTION)
        emotion = np.array([names.index(e) for e in examples.emotions])
        moves = len(training.movements) - int((emotion == len(names) - 1).sum())
        whole = len(training.intensities)
        self._memberships = training.memberships[: whole + moves]
        self._emotion: IntArray = np.concatenate(
            [np.tile(emotion, len(AMOUNTS)), np.full(moves, len(names) - 1)]
        )
        intensities = np.concatenate([training.intensities, np.zeros(moves)])
        weight = np.concatenate([np.tile(_balance(examples), len(AMOUNTS)), np.zeros(moves)])
        weight[:whole] /= len(AMOUNTS)
        unlike = ~training.similar(emotion < len(names) - 1)[:moves]
        weight[whole:] = _MOVEMENTS * unlike / max(moves, 1)
        intensities[self._emotion == len(names) - 1] = 0.0
        self._intensities, self._weight = intensities, weight
        self._none = np.flatnonzero((self._emotion == len(names) - 1) & (weight > 0))
        self._limit = np.where(self._none < whole, _LARGEST_NONE, _LARGEST_MOVEMENT)
        self._add_partial_faces(whole)
        self._concluded = np.zeros((len(names) - 1, len(self._intensities)))
        self._fired, self._most = np.zeros((2, len(self._intensities)))
        self.cost = float(self._weight @ self._intensities**2)

    def _add_partial_faces(self, whole: int) -> None:
        """Add the faces without one of their parts."""
        training = self._training
        term_count, count = training.term_count, len(training.examples.emotions)
        own = whole - count + np.flatnonzero(np.array(training.examples.emotions) != NO_EMOTION)
        part = _parts(training)[training.terms.feature]
        partial, rows = [], []
        for number in np.unique(part):
            lost = np.flatnonzero(part == number)
            degree = self._memberships[own]
            moved = degree[:, lost].max(axis=1) > _MOVED
            degree[:, lost], degree[:, term_count + lost] = 0.0, 1.0
            counts = moved & (degree[:, :term_count].max(axis=1) > _MOVED)
            partial.append(degree[counts])
            rows.append(own[counts])
        at = np.concatenate(rows)
        times = np.bincount(at, minlength=len(self._weight))
        less = self._weight * np.where(times > 0, _PARTIAL, 0.0)
        self._weight = np.concatenate([self._weight - less, (less / np.maximum(times, 1))[at]])
        self._memberships = np.concatenate([self._memberships, *partial])
        self._intensities = np.concatenate([self._intensities, self._intensities[at]])
        self._emotion = np.concatenate([self._emotion, self._emotion[at]])

    def _firing(self, conditions: Conditions) -> FloatArray:
        return np.asarray(self._memberships[:, self._training.columns(conditions)].min(axis=1))

    def add(self, emotion: int, conditions: Conditions, weight: float) -> None:
        """Add a rule."""
        fired = weight * self._firing(conditions)
        self._concluded[emotion] += fired
        self._fired += fired
        self._most = np.maximum(self._most, fired)
        output = self._concluded / (self._fired + 1.0 - self._most)
        target = self._intensities * (self._emotion == np.arange(len(output))[:, None])
        self.cost = float(self._weight @ ((output - target) ** 2).sum(axis=0))

    def costs(self, rules: Sequence[tuple[int, Conditions]]) -> FloatArray:
        """Return the cost with each of the rules added as a fallback rule: (R,)."""
        squares = (self._concluded**2).sum(axis=0)
        # Of the right emotion's rules; 0 for no emotion.
        right = np.concatenate([self._concluded, np.zeros((1, len(self._fired)))])
        right = right[self._emotion, np.arange(len(self._emotion))]
        found = []
        for emotion, conditions in rules:
            fired = FALLBACK_WEIGHT * self._firing(conditions)
            total = self._fired + fired + 1.0 - np.maximum(self._most, fired)
            size = squares + fired * (2 * self._concluded[emotion] + fired)
            own = right + fired * (self._emotion == emotion)
            off = (size / total - 2 * own * self._intensities) / total + self._intensities**2
            exceeds = ((self._concluded[emotion] + fired) / total)[self._none] > self._limit
            if (exceeds & (fired[self._none] > 0)).any():
                found.append(np.inf)
                continue
            found.append(float(self._weight @ off) + self._price(conditions))
        return np.round(np.array(found), _DIGITS)

    def _price(self, conditions: Conditions) -> float:
        noise = self._training.noise[self._training.columns(conditions)].max()
        return _CONDITION_COST * len(conditions) + _NOISE_COST * float(noise)

    def shortlist(self, emotion: int, candidates: list[Conditions]) -> list[Conditions]:
        """Return the candidates that lower the cost most."""
        costs = self.costs([(emotion, c) for c in candidates])
        best = np.argsort(costs, kind="stable")[:_SHORTLIST]
        return [candidates[i] for i in sorted(best.tolist())]


def _balance(examples: Examples) -> FloatArray:
    """Return weights (N,): every emotion, and no emotion, weighs 1, its variants alike."""
    weight = np.zeros(len(examples.emotions))
    for emotion in {*examples.names, NO_EMOTION}:
        variants = examples.variants_of(emotion) if emotion != NO_EMOTION else (None,)
        for variant in variants:
            rows = examples.rows(emotion, variant)
            weight[rows] = 1.0 / max(len(variants) * int(rows.sum()), 1)
    return weight


def _parts(training: TrainingSet) -> IntArray:
    """Return the part of the face of each feature: (I,); 0 = it does not move."""
    examples = training.examples
    motions = np.nan_to_num(np.concatenate([examples.features, examples.movements]))
    reach = np.abs(motions).max(axis=0)
    moving = np.flatnonzero(reach > LEAST_SIGNAL * examples.noise)
    part = np.zeros(len(reach), dtype=np.int64)
    if len(moving) < 2:
        part[moving] = 1
        return part
    unit = motions[:, moving] / np.linalg.norm(motions[:, moving], axis=0)
    apart = np.clip(1.0 - np.abs(unit.T @ unit), 0.0, None)
    np.fill_diagonal(apart, 0.0)
    apart = np.round((apart + apart.T) / 2, _DIGITS)
    tree = linkage(squareform(apart, checks=False), "average")
    part[moving] = clusters(tree, _PARTS)
    return part


def _candidates(emotion: int, training: TrainingSet) -> Iterator[Conditions]:
    """Yield one or two terms of an emotion, or one and a negated term of others."""
    own, others = _term_candidates(emotion, training)
    marker = training.marker
    for term in own:
        yield ((term, False),)
    for one, two in combinations(own, 2):
        if marker[one] != marker[two]:
            yield (one, False), (two, False)
    for one in own:
        for two in others:
            if marker[one] != marker[two]:
                yield (one, False), (two, True)


def _term_candidates(emotion: int, training: TrainingSet) -> tuple[list[int], list[int]]:
    """Return the terms that distinguish an emotion from others, and those that others meet."""
    examples, term_count = training.examples, training.term_count
    degree = training.whole[:, :term_count]
    names = [*examples.names, NO_EMOTION]
    weight = _balance(examples)
    rows = [examples.rows(name) * weight for name in names]
    met = np.array([row @ degree for row in rows])
    rest = np.delete(met, emotion, axis=0)
    own = met[emotion] - rest.mean(axis=0) - training.noise[:term_count]
    negatable = rest.max(axis=0) + rest.mean(axis=0) - 2 * met[emotion]
    spread = np.maximum(degree.std(axis=0), 1e-9)
    centred = (degree - degree.mean(axis=0)) / (spread * np.sqrt(len(degree)))
    return (
        _uncorrelated(np.where(met[emotion] > _LEAST_MET, own, -np.inf), centred, _OWN, -np.inf),
        _uncorrelated(negatable, centred, _OTHERS, 0.0),
    )


def _uncorrelated(score: FloatArray, centred: FloatArray, count: int, least: float) -> list[int]:
    """Return the best terms, no two of them correlated."""
    score = np.round(score, _DIGITS)
    chosen: list[int] = []
    while len(chosen) < count and score.max() > least:
        best = int(np.argmax(score))
        chosen.append(best)
        score[(centred.T @ centred[:, best] > _TOGETHER)] = -np.inf
        score[best] = -np.inf
    return chosen
