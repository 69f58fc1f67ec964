"""Hints: short rules of little weight, for faces that no learned rule knows.

A learned rule asks for everything that tells its variant from all others, so it is silent when a
part is missing: what another variant of the emotion, or another person, does not show. Hints are
rules of one or two conditions that are learned from faces of which a part is taken away. They
weigh little: where a learned rule fires they hardly count, where none does they decide together.

Parts are features that move together over all examples and movements (average linkage of the
cosines of their motions). Hints are added one at a time, each the one that most lowers

    mean of sum_e (answer_e - shown_e)^2 over faces, whole and each without one of its parts

of the system as it stands, rules and hints together, with a price for every condition; every
emotion, and what means none, weighs the same in the mean. This is stagewise fitting (J. Friedman,
"Greedy Function Approximation: A Gradient Boosting Machine", 2001) with rules for learners.
"""

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np
from scipy.cluster.hierarchy import linkage
from scipy.spatial.distance import squareform

from usdface.rule_learning.clusters import clusters
from usdface.rule_learning.examples import NO_EMOTION, Examples
from usdface.rule_learning.redundancy import subsumes
from usdface.rule_learning.rules import LearnedRule
from usdface.rule_learning.terms import Words
from usdface.rule_learning.training_set import AMOUNTS, Conditions, Faces
from usdface.takes import FloatArray, IntArray

__all__ = ["learn_hints"]

# A quarter is exact in USD's float, so that a written system answers the same to the last bit.
_WEIGHT = 0.25
_MOST_HINTS = 3  # of one emotion
_PARTS = 6
# Of the weight of whole faces, what is theirs without a part.
_THINNED = 0.5
# A part counts as moved, and what is left of a face as enough, if some term is met this far.
_MOVED = 0.25
# Of movements that mean no emotion, when each emotion weighs 1.
_MOVEMENTS = 0.3
# What hints may make of a face that means none, and of a single movement, beyond what rules do.
_LOUDEST_NONE, _LOUDEST_MOVEMENT = 0.05, 0.2
# Price of a condition, and of one that is as small as its noise.
_CONDITION_COST = 0.002
_NOISE_COST = 0.02
# Motions that hints of one emotion may ask for, and motions of others that they may deny.
_OWN, _OTHERS = 8, 6
# What an emotion's examples meet on average: of what is asked at least, of what is denied at most.
_LEAST_MET, _MOST_DENIED = 0.15, 0.3
# Of motions that go together more than this (correlation) one is enough.
_TOGETHER = 0.95
# Candidates that are tried again after each hint, of each emotion.
_SHORTLIST = 20
_LEAST_SIGNAL = 4.0
_DIGITS = 6


def learn_hints(
    examples: Examples, words: Words, rules: Sequence[LearnedRule]
) -> list[LearnedRule]:
    """Learn what to add to the rules for faces that lack a part of what they ask for.

    Parameters
    ----------
    examples : Examples
    words : Words
    rules : sequence of LearnedRule
        Of `usdface.rule_learning.rules.learn_rules`, with these words.

    Returns
    -------
    list of LearnedRule
        In the order of the emotions; none says what a rule or another hint says already.
    """
    faces = Faces(examples, words)
    if not faces.terms:
        return []
    names = examples.names
    system = _System(faces)
    for rule in rules:
        system.add(names.index(rule.emotion), rule.conditions, rule.weight)
    kept = {e: [r.conditions for r in rules if r.emotion == name] for e, name in enumerate(names)}
    waiting = [
        (emotion, conditions)
        for emotion in range(len(names))
        for conditions in system.shortlist(emotion, list(_candidates(emotion, faces)))
    ]
    hints: list[tuple[int, Conditions]] = []
    while waiting:
        waiting = [
            (e, c)
            for e, c in waiting
            if not any(subsumes(said, c, words) for said in kept[e])
            and not any(subsumes(c, said, words) for of, said in hints if of == e)
        ]
        costs = system.costs(waiting)
        if not len(costs) or costs.min() >= system.cost:
            break
        best = waiting[int(np.argmin(costs))]
        system.add(*best, _WEIGHT)
        hints.append(best)
        kept[best[0]].append(best[1])
        full = sum(e == best[0] for e, _ in hints) >= _MOST_HINTS
        waiting = [(e, c) for e, c in waiting if not (full and e == best[0])]
    hints.sort(key=lambda hint: hint[0])
    return [LearnedRule(names[e], conditions, _WEIGHT) for e, conditions in hints]


class _System:
    """What rules and hints answer so far, to whole faces and to faces without a part."""

    def __init__(self, faces: Faces) -> None:
        self._faces = faces
        examples = faces.examples
        names = (*examples.names, NO_EMOTION)
        emotion = np.array([names.index(e) for e in examples.emotions])
        moves = len(faces.movements) - int((emotion == len(names) - 1).sum())
        whole = len(faces.shown)
        self._degree = faces.degree[: whole + moves]
        self._emotion: IntArray = np.concatenate(
            [np.tile(emotion, len(AMOUNTS)), np.full(moves, len(names) - 1)]
        )
        shown = np.concatenate([faces.shown, np.zeros(moves)])
        weight = np.concatenate([np.tile(_balance(examples), len(AMOUNTS)), np.zeros(moves)])
        weight[:whole] /= len(AMOUNTS)
        unlike = ~faces.alike(emotion < len(names) - 1)[:moves]
        weight[whole:] = _MOVEMENTS * unlike / max(moves, 1)
        shown[self._emotion == len(names) - 1] = 0.0
        self._shown, self._weight = shown, weight
        self._quiet = np.flatnonzero((self._emotion == len(names) - 1) & (weight > 0))
        self._limit = np.where(self._quiet < whole, _LOUDEST_NONE, _LOUDEST_MOVEMENT)
        self._add_thinned(whole)
        self._said = np.zeros((len(names) - 1, len(self._shown)))
        self._fired, self._most = np.zeros((2, len(self._shown)))
        self.cost = float(self._weight @ self._shown**2)

    def _add_thinned(self, whole: int) -> None:
        """Complete the faces with those that lack one of their parts."""
        faces = self._faces
        terms, count = faces.terms, len(faces.examples.emotions)
        own = whole - count + np.flatnonzero(np.array(faces.examples.emotions) != NO_EMOTION)
        part = _parts(faces)[faces.words.feature]
        thinned, rows = [], []
        for number in np.unique(part):
            lost = np.flatnonzero(part == number)
            degree = self._degree[own]
            moved = degree[:, lost].max(axis=1) > _MOVED
            degree[:, lost], degree[:, terms + lost] = 0.0, 1.0
            counts = moved & (degree[:, :terms].max(axis=1) > _MOVED)
            thinned.append(degree[counts])
            rows.append(own[counts])
        at = np.concatenate(rows)
        times = np.bincount(at, minlength=len(self._weight))
        less = self._weight * np.where(times > 0, _THINNED, 0.0)
        self._weight = np.concatenate([self._weight - less, (less / np.maximum(times, 1))[at]])
        self._degree = np.concatenate([self._degree, *thinned])
        self._shown = np.concatenate([self._shown, self._shown[at]])
        self._emotion = np.concatenate([self._emotion, self._emotion[at]])

    def _firing(self, conditions: Conditions) -> FloatArray:
        return np.asarray(self._degree[:, self._faces.columns(conditions)].min(axis=1))

    def add(self, emotion: int, conditions: Conditions, weight: float) -> None:
        """Add a rule."""
        fired = weight * self._firing(conditions)
        self._said[emotion] += fired
        self._fired += fired
        self._most = np.maximum(self._most, fired)
        answer = self._said / (self._fired + 1.0 - self._most)
        target = self._shown * (self._emotion == np.arange(len(answer))[:, None])
        self.cost = float(self._weight @ ((answer - target) ** 2).sum(axis=0))

    def costs(self, rules: Sequence[tuple[int, Conditions]]) -> FloatArray:
        """Return the cost with each of the rules added as a hint: (R,)."""
        squares = (self._said**2).sum(axis=0)
        # What the right emotion's rules say; of no emotion nothing.
        right = np.concatenate([self._said, np.zeros((1, len(self._fired)))])
        right = right[self._emotion, np.arange(len(self._emotion))]
        found = []
        for emotion, conditions in rules:
            fired = _WEIGHT * self._firing(conditions)
            total = self._fired + fired + 1.0 - np.maximum(self._most, fired)
            size = squares + fired * (2 * self._said[emotion] + fired)
            own = right + fired * (self._emotion == emotion)
            off = (size / total - 2 * own * self._shown) / total + self._shown**2
            loud = ((self._said[emotion] + fired) / total)[self._quiet] > self._limit
            if (loud & (fired[self._quiet] > 0)).any():
                found.append(np.inf)
                continue
            found.append(float(self._weight @ off) + self._price(conditions))
        return np.round(np.array(found), _DIGITS)

    def _price(self, conditions: Conditions) -> float:
        noise = self._faces.noise[self._faces.columns(conditions)].max()
        return _CONDITION_COST * len(conditions) + _NOISE_COST * float(noise)

    def shortlist(self, emotion: int, candidates: list[Conditions]) -> list[Conditions]:
        """Return the candidates that are worth trying: those that now lower the cost most."""
        costs = self.costs([(emotion, c) for c in candidates])
        best = np.argsort(costs, kind="stable")[:_SHORTLIST]
        return [candidates[i] for i in sorted(best.tolist())]


def _balance(examples: Examples) -> FloatArray:
    """Return weights (N,): every emotion, and none, weighs 1, its variants alike."""
    weight = np.zeros(len(examples.emotions))
    for emotion in {*examples.names, NO_EMOTION}:
        variants = examples.variants_of(emotion) if emotion != NO_EMOTION else (None,)
        for variant in variants:
            rows = examples.rows(emotion, variant)
            weight[rows] = 1.0 / max(len(variants) * int(rows.sum()), 1)
    return weight


def _parts(faces: Faces) -> IntArray:
    """Return which part of the face each feature belongs to: (I,); 0 = it does not move."""
    examples = faces.examples
    motions = np.nan_to_num(np.concatenate([examples.features, examples.movements]))
    reach = np.abs(motions).max(axis=0)
    moving = np.flatnonzero(reach > _LEAST_SIGNAL * examples.noise)
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


def _candidates(emotion: int, faces: Faces) -> Iterator[Conditions]:
    """Yield one or two motions of an emotion, or one without a motion of others."""
    own, others = _motions(emotion, faces)
    marker = faces.marker
    for term in own:
        yield ((term, False),)
    for one, two in combinations(own, 2):
        if marker[one] != marker[two]:
            yield (one, False), (two, False)
    for one in own:
        for two in others:
            if marker[one] != marker[two]:
                yield (one, False), (two, True)


def _motions(emotion: int, faces: Faces) -> tuple[list[int], list[int]]:
    """Return the terms that an emotion meets and others do not, and those that others meet."""
    examples, terms = faces.examples, faces.terms
    degree = faces.whole[:, :terms]
    names = [*examples.names, NO_EMOTION]
    weight = _balance(examples)
    rows = [examples.rows(name) * weight for name in names]
    met = np.array([row @ degree for row in rows])
    rest = np.delete(met, emotion, axis=0)
    own = met[emotion] - rest.mean(axis=0) - faces.noise[:terms]
    denied = rest.max(axis=0) + rest.mean(axis=0) - 2 * met[emotion]
    spread = np.maximum(degree.std(axis=0), 1e-9)
    centred = (degree - degree.mean(axis=0)) / (spread * np.sqrt(len(degree)))
    return (
        _apart(np.where(met[emotion] > _LEAST_MET, own, -np.inf), centred, _OWN, -np.inf),
        _apart(np.where(met[emotion] < _MOST_DENIED, denied, -np.inf), centred, _OTHERS, 0.0),
    )


def _apart(score: FloatArray, centred: FloatArray, count: int, least: float) -> list[int]:
    """Return the best terms of which no two go together."""
    score = np.round(score, _DIGITS)
    chosen: list[int] = []
    while len(chosen) < count and score.max() > least:
        best = int(np.argmax(score))
        chosen.append(best)
        score[(centred.T @ centred[:, best] > _TOGETHER)] = -np.inf
        score[best] = -np.inf
    return chosen
