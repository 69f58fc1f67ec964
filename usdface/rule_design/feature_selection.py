"""Feature selection: the marker motions that show one expression, where and as strongly as it does.

A feature is one marker's displacement along one axis, relative to the nose tip; column
``3 * marker + axis`` of a (.., I) array, I = 3 M, in metres. Features of both sides are chosen
together, among those that move most in the expression: mouth corners for joy, brows for surprise.
Those above the nose tip and those below it are two groups where the expression has brows and a
mouth. A rule asks for most of each group, so one wrong condition does not silence it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.blend_shape_evaluator import BlendShapeEvaluator
from usdface.fuzzy.norms import most_of
from usdface.rule_design.feature_noise import exceeds_noise
from usdface.rule_design.movements import Movements
from usdface.rule_design.negative_conditions import (
    LEAST_FIRING,
    Ramp,
    negative_conditions,
    ramp_membership,
)

__all__ = ["FEWEST", "SelectedFeatures", "group_firing", "select_features"]

# Fewer conditions than this are joined by AND: of two, most are both.
FEWEST = 3

# Tuned by hand against benchmarks/expressions.py and benchmarks/expression_takes.py, which judge
# them, unless noted otherwise; see docs/constants.md.
# In standard deviations of a feature's noise: a term jitters by a quarter of its reach at most.
_LEAST_SIGNAL = 4.0
# Shares of the value at the pose: where a term begins (dead zone), and where it holds fully.
_DEAD_ZONE = 0.02
_TOP = 0.94
# Features of a group move at least by this share of the largest motion in their half of the face,
# and where the halves are one group, a half by this share of the other.
_STRONG = 0.25
# A feature and its twin are one candidate where the weaker moves by this share of the other.
_EVEN = 0.5
_HALF_MOVES = 0.3
# Error of a feature on another person's face [m]: what the solve leaves of a bend of the space map.
_FACE_ERROR = 0.0005
# Cost of a feature whose motion is as small as its error.
_ERROR_COST = 10.0
# Most pairs of features in a group; a group of both halves may have more. Fewer conditions than
# `_ENOUGH` cost something each: of five one may be wrong.
_MOST_PAIRS, _MORE_PAIRS = 4, 2
_ENOUGH, _MISSING_COST, _SAME_MARKER_COST = 5, 12.0, 0.3
# Fewer than `FEWEST` only where there are no more.
_TOO_FEW_COST = 1000.0
# Likeness to the pose (cosine; either half of the face counts alike) from which a movement
# is the expression, or a part of it, and up to which it is a rival.
_SAME, _PART, _RIVAL = 0.85, 0.8, 0.6
# Costs of silence: at the pose, at a movement that is the expression, at the pose without a part,
# and at all poses with one more movement at half.
_POSE, _LIKE, _WITHOUT, _WITH = 6.0, 3.0, 2.0, 4.0
# Costs of firing: at another pose, at half and whole; and, all together, at other poses with one
# more movement, at movements alone, and at several; at the worst of all.
_OTHER_POSE, _VARIED, _ALONE, _MIXED, _WORST = 250.0, 40.0, 60.0, 120.0, 3.0
_MORE, _HALF = 0.6, 0.5
# A change of the selection has to take away this share of the cost.
_LEAST_GAIN = 0.005
_STEPS = 60
# Numerical: costs are rounded, as the choice between equal features must not hang on last bits.
_DIGITS = 4
# Least motion of a half of the face that counts in likeness [m]: noise is no expression.
_STILL = 0.0015
# Threshold of EXPRESSION_UNSEEN: the other expression then fires the rule as far as its own half.
_CONFUSED = 0.5


@dataclass(frozen=True, slots=True)
class SelectedFeatures:
    """The features of one expression.

    Attributes
    ----------
    ramps : dict of int to (float, float)
        Feature to the signed values [m] where its term begins (the end of the dead zone around
        neutral) and where it is 1 (at the expression's pose). Empty = no feature shows it.
    groups : tuple of tuple of int
        The features of `ramps`, of which most have to hold in each group.
    negative : tuple of (int, (float, float))
        Features and the ramps of their negated conditions, see
        `usdface.rule_design.negative_conditions`.
    confused : tuple of int
        Other expressions that these features cannot distinguish from it.
    shared : tuple of (int, float)
        Other expressions that fire its rule weakly, with the firing strength: 1 minus that is the
        largest output left for them.
    """

    ramps: dict[int, Ramp]
    groups: tuple[tuple[int, ...], ...] = ()
    negative: tuple[tuple[int, Ramp], ...] = ()
    confused: tuple[int, ...] = ()
    shared: tuple[tuple[int, float], ...] = ()


def group_firing(memberships: Sequence[FloatArray]) -> FloatArray:
    """Return how far a group of conditions holds, from their memberships (N,) each."""
    if len(memberships) < FEWEST:
        return np.asarray(np.min(memberships, axis=0))
    return most_of(memberships)


def select_features(
    index: int,
    poses: FloatArray,
    moves: Movements,
    features: BlendShapeEvaluator,
    noise: FloatArray,
    upper: BoolArray,
    twins: IntArray,
    apart: bool,
) -> SelectedFeatures:
    """Choose the features that show one expression and none of its rivals.

    Parameters
    ----------
    index : int
        Row of the expression in `poses`.
    poses : (E, S) float64
        All expression poses.
    moves : Movements
    features : BlendShapeEvaluator
        Of the features, N = I.
    noise : (I,) float64 [m]
        Standard deviation of each feature.
    upper : (I,) bool
        Features of markers above the nose tip.
    twins : (I,) int64
        The feature on the other side; itself where there is none.
    apart : bool
        Whether the upper and the lower half are two groups.
    """
    own = _features_at(features, poses[index : index + 1])[0]
    ramps = _ramps(own)
    candidates = _candidates(own, noise, upper, twins, apart)
    if not candidates:
        return SelectedFeatures({})
    scene = _scene(index, poses, moves, features, own, upper)
    chosen = _search(candidates, scene, own, noise, apart)
    groups = tuple(
        tuple(f for pair in chosen for f in pair.features if pair.group == group)
        for group in sorted({pair.group for pair in chosen})
    )
    used = {f: ramps[f] for group in groups for f in group}
    others = np.delete(np.arange(len(poses)), index)
    moved = _features_at(features, poses[others])
    firing = np.min(
        [group_firing([ramp_membership(moved[:, f], *used[f]) for f in g]) for g in groups], axis=0
    )
    movements = _features_at(features, moves.single)
    negative, firing = negative_conditions(own, moved, firing, used, movements, noise)
    partly = (firing > LEAST_FIRING) & (firing <= _CONFUSED)
    shared = zip(others[partly].tolist(), firing[partly].tolist(), strict=True)
    confused = map(int, others[firing > _CONFUSED])
    return SelectedFeatures(used, groups, negative, tuple(confused), tuple(shared))


def _features_at(features: BlendShapeEvaluator, weights: FloatArray) -> FloatArray:
    """Return the features of a face at weights (N, S): (N, I) [m]."""
    return features.displacements(features.combined(weights))


def _ramps(own: FloatArray) -> list[Ramp]:
    """Return the ramp of each feature."""
    return [(float(_DEAD_ZONE * value), float(_TOP * value)) for value in own]


@dataclass(frozen=True, slots=True)
class _Pair:
    """A candidate: a feature, or it and its twin, and the group that it belongs to."""

    features: tuple[int, ...]
    group: int


def _candidates(
    own: FloatArray, noise: FloatArray, upper: BoolArray, twins: IntArray, apart: bool
) -> list[_Pair]:
    """Return the features that move clearly and strongly in the expression, with their twins.

    Where those are too few for a group, the strongest of the others that move clearly.
    """
    size = np.abs(own)
    clear = exceeds_noise(size, noise, _LEAST_SIGNAL)
    largest = {half: size[upper == half].max(initial=0.0) for half in (True, False)}
    if not apart:
        still = [h for h, s in largest.items() if s < _HALF_MOVES * max(largest.values())]
        clear &= ~np.isin(upper, still)
    pairs: dict[int, list[tuple[float, _Pair]]] = {}
    for feature in np.flatnonzero(clear).tolist():
        twin, half = int(twins[feature]), bool(upper[feature])
        both = twin != feature and clear[twin] and size[twin] >= _EVEN * size[feature]
        if both and twin < feature:
            continue
        pair = _Pair((feature, twin) if both else (feature,), int(half) if apart else 0)
        share = float(size[list(pair.features)].min() / largest[half])
        pairs.setdefault(pair.group, []).append((share, pair))
    found: list[_Pair] = []
    for _, listed in sorted(pairs.items()):
        conditions, taken = 0, set()
        for share, pair in sorted(
            listed, key=lambda each: (-round(each[0], _DIGITS), each[1].features)
        ):
            if share >= _STRONG or conditions < _ENOUGH:
                conditions += len(pair.features)
                taken.add(pair)
        found += [pair for _, pair in listed if pair in taken]
    return found


@dataclass(frozen=True, eq=False, slots=True)
class _Scene:
    """Features (P, I) of faces that a rule is to fire on, and not to, with the costs (P,)."""

    wanted: FloatArray
    wanted_costs: FloatArray
    rivals: FloatArray
    rival_costs: FloatArray


def _scene(
    index: int,
    poses: FloatArray,
    moves: Movements,
    features: BlendShapeEvaluator,
    own: FloatArray,
    upper: BoolArray,
) -> _Scene:
    pose = poses[index]
    others = np.delete(poses, index, axis=0)

    def unlike(weights: FloatArray, most: float) -> FloatArray:
        return weights[_likeness(_features_at(features, weights), own, upper) < most]

    def like(weights: FloatArray, least: float) -> FloatArray:
        weights = weights[weights.any(axis=1)]
        return weights[_likeness(_features_at(features, weights), own, upper) > least]

    without = np.unique(np.where(moves.whole > 0, 0.0, pose), axis=0)
    varied = np.clip(others[:, None] + _MORE * moves.whole, 0.0, 1.0).reshape(-1, len(pose))
    mostly = unlike(np.concatenate([moves.single, _HALF * moves.single]), _PART)
    wanted = [
        (pose[None], _POSE),
        (like(moves.whole * pose.max(initial=0.0), _SAME), _LIKE),
        (like(without[(without < pose).any(axis=1)], _PART), _WITHOUT),
        (like(np.clip(pose + _HALF * moves.whole, 0.0, 1.0), _PART), -_WITH),
    ]
    rivals = [
        (np.concatenate([others, _HALF * others]), _OTHER_POSE),
        (unlike(varied, _RIVAL + 0.1), -_VARIED),
        (mostly, -_ALONE),
        (unlike(moves.mixed, _RIVAL), -_MIXED),
    ]
    return _Scene(
        _features_at(features, np.concatenate([rows for rows, _ in wanted])),
        _costs(wanted),
        _features_at(features, np.concatenate([rows for rows, _ in rivals])),
        _costs(rivals),
    )


def _costs(parts: Sequence[tuple[FloatArray, float]]) -> FloatArray:
    """Return the cost of each row; a negative one is shared by all rows of its part."""
    return np.concatenate(
        [np.full(len(rows), c if c > 0 else -c / max(len(rows), 1)) for rows, c in parts]
    )


def _likeness(moved: FloatArray, own: FloatArray, upper: BoolArray) -> FloatArray:
    """Return the cosine between faces (P, I) and the expression (I,): (P,).

    Each half of the face is divided by the largest motion of the expression in it, so that a jaw
    does not outweigh the brows.
    """
    scale = np.ones(len(own))
    for half in (upper, ~upper):
        largest = float(np.abs(own[half]).max(initial=0.0))
        scale[half] = np.sqrt(max(half.sum(), 1)) * max(largest, _STILL)
    a, b = moved / scale, own / scale
    lengths = np.linalg.norm(a, axis=1) * np.linalg.norm(b)
    return np.asarray(np.divide(a @ b, lengths, out=np.zeros(len(a)), where=lengths > 0))


class _Cost:
    """The cost of a selection of candidates: silence and false firing, error, and missing pairs."""

    def __init__(
        self,
        candidates: Sequence[_Pair],
        scene: _Scene,
        own: FloatArray,
        noise: FloatArray,
        joined: bool,
    ) -> None:
        self._scene = scene
        self._groups = np.array([0 if joined else pair.group for pair in candidates])
        self._counts = np.array([len(pair.features) for pair in candidates])
        self._markers = [pair.features[0] // 3 for pair in candidates]
        error = np.sqrt(noise**2 + _FACE_ERROR**2) / np.maximum(np.abs(own), _FACE_ERROR)
        self._error = np.array([(error[list(p.features)] ** 2).max() for p in candidates])
        ramps = _ramps(own)

        def met(rows: FloatArray) -> list[list[FloatArray]]:
            return [
                [ramp_membership(rows[:, f], *ramps[f]) for f in p.features] for p in candidates
            ]

        self._wanted, self._rivals = met(scene.wanted), met(scene.rivals)

    def __call__(self, chosen: Sequence[int]) -> float:
        """Return the cost of the candidates `chosen`."""
        fired, missed = self._firing(self._rivals, chosen), 1 - self._firing(self._wanted, chosen)
        squares = fired**2
        cost = self._scene.rival_costs @ squares + _WORST * squares.max(initial=0.0)
        cost += self._scene.wanted_costs @ missed**2
        cost += _ERROR_COST * self._error[list(chosen)].mean()
        own, counts = self._groups[list(chosen)], self._counts[list(chosen)]
        for group in np.unique(self._groups):
            conditions = int(counts[own == group].sum())
            cost += _MISSING_COST * max(0, _ENOUGH - conditions)
            cost += _TOO_FEW_COST * max(0, FEWEST - conditions)
        cost += _SAME_MARKER_COST * (len(chosen) - len({self._markers[k] for k in chosen}))
        return round(float(cost), _DIGITS)

    def _firing(self, met: Sequence[list[FloatArray]], chosen: Sequence[int]) -> FloatArray:
        parts = []
        for group in np.unique(self._groups[list(chosen)]):
            parts.append(
                group_firing([m for k in chosen if self._groups[k] == group for m in met[k]])
            )
        return np.asarray(np.min(parts, axis=0))


def _search(
    candidates: Sequence[_Pair], scene: _Scene, own: FloatArray, noise: FloatArray, apart: bool
) -> list[_Pair]:
    """Return the candidates of the least cost: adding, replacing and dropping one at a time.

    A half of the face with too few of them for a group of its own is joined with the other, which
    then has no more: brows that two markers show weigh as much as the mouth.
    """
    sizes = {p.group: 0 for p in candidates}
    for pair in candidates:
        sizes[pair.group] += len(pair.features)
    most, joined = 2 * (_MOST_PAIRS if apart else _MOST_PAIRS + _MORE_PAIRS), False
    if len(sizes) > 1 and min(sizes.values()) < FEWEST:
        most, joined = max(min(sizes.values()), 2), True
    cost = _Cost(candidates, scene, own, noise, joined)
    chosen = [
        min((k for k, p in enumerate(candidates) if p.group == group), key=lambda k: cost([k]))
        for group in sorted(sizes)
    ]
    total = cost(chosen)
    for _ in range(_STEPS):
        changed = [(cost(change), change) for change in _changes(chosen, candidates, most)]
        if not changed:
            break
        least, best = min(changed, key=lambda each: each[0])
        if not least < (1 - _LEAST_GAIN) * total:
            break
        total, chosen = least, best
    return [replace(candidates[k], group=0) if joined else candidates[k] for k in chosen]


def _changes(chosen: list[int], candidates: Sequence[_Pair], most: int) -> Iterator[list[int]]:
    """Yield selections that differ by one candidate; no group is left empty or has too many."""
    for k, pair in enumerate(candidates):
        if k in chosen:
            continue
        fellows = [c for c in chosen if candidates[c].group == pair.group]
        conditions = sum(len(candidates[c].features) for c in fellows) + len(pair.features)
        if conditions <= most:
            yield [*chosen, k]
        for other in fellows:
            if conditions - len(candidates[other].features) <= most:
                yield [k if c == other else c for c in chosen]
    for i, pair in enumerate([candidates[c] for c in chosen]):
        if sum(candidates[c].group == pair.group for c in chosen) > 1:
            yield [*chosen[:i], *chosen[i + 1 :]]
