"""Feature selection: the marker motions that distinguish one expression from all others.

A feature is one marker's displacement along one axis, relative to the nose tip; column
``3 * marker + axis`` of a (.., I) array, I = 3 M, in metres. Features of both sides are chosen
together, among those that move most in the expression: mouth corners for joy, brows for surprise.
Those above the nose tip and those below it are two groups where the expression has brows and a
mouth. A rule requires most of each group, so one wrong condition does not silence it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from usdface.arrays import FloatArray
from usdface.numerics.ramps import linear_ramp
from usdface.rule_design.face_motions import FaceMotions
from usdface.rule_design.feature_errors import FeatureErrors
from usdface.rule_design.feature_noise import exceeds_noise
from usdface.rule_design.negative_conditions import (
    LEAST_FIRING,
    NegativeCondition,
    Ramp,
    negative_conditions,
)
from usdface.rule_design.selection_cost import (
    FEWEST,
    FeaturePair,
    SelectionCost,
    feature_ramps,
    group_firing,
)
from usdface.rule_design.trial_faces import TrialFaces, trial_faces

__all__ = ["SelectedFeatures", "select_features"]

# Tuned by hand against benchmarks/expressions.py and benchmarks/expression_takes.py, which judge
# them, unless noted otherwise; see docs/constants.md.
# In standard deviations of a feature's noise: a term jitters by a quarter of its reach at most.
_LEAST_SIGNAL = 4.0
# Features of a group move at least by this share of the largest motion in their half of the face,
# and where the halves are one group, a half by this share of the other.
_STRONG = 0.25
# A feature and its twin are one candidate where the weaker moves by this share of the other.
_EVEN = 0.5
_HALF_MOVES = 0.3
# Features that move clearly are taken, strong or not, until a group has so many.
_ENOUGH = 5
# Most pairs of features in a group; a group of both halves may have more.
_MOST_PAIRS, _MORE_PAIRS = 4, 2
# A change of the selection has to take away this share of the cost.
_LEAST_GAIN = 0.005
_STEPS = 60
# Numerical: shares are rounded, as the choice between equal features must not hang on last bits.
_DIGITS = 4
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
    negative : tuple of NegativeCondition
        See `usdface.rule_design.negative_conditions`.
    confused : tuple of int
        Other expressions that these features cannot distinguish from it.
    shared : tuple of (int, float)
        Other expressions that fire its rule weakly, with the firing strength: 1 minus that is the
        largest output left for them.
    """

    ramps: dict[int, Ramp]
    groups: tuple[tuple[int, ...], ...] = ()
    negative: tuple[NegativeCondition, ...] = ()
    confused: tuple[int, ...] = ()
    shared: tuple[tuple[int, float], ...] = ()

    @property
    def terms(self) -> tuple[tuple[int, Ramp], ...]:
        """The feature and the ramp of each condition."""
        return (*self.ramps.items(), *(part for each in self.negative for part in each))


def select_features(
    index: int, motions: FaceMotions, errors: FeatureErrors, *, apart: bool
) -> SelectedFeatures:
    """Choose the features that show one expression and none of its rivals.

    Parameters
    ----------
    index : int
        Row of the expression in the poses.
    motions : FaceMotions
    errors : FeatureErrors
        At the expression's pose.
    apart : bool
        Whether the upper and the lower half are two groups.
    """
    poses = motions.poses
    own = motions.features(poses[index : index + 1])[0]
    ramps = feature_ramps(own)
    candidates = _candidates(own, errors.noise, motions, apart)
    if not candidates:
        return SelectedFeatures({})
    scene = trial_faces(index, motions)
    chosen = _search(candidates, scene, own, errors, apart)
    groups = tuple(
        tuple(f for pair in chosen for f in pair.features if pair.group == group)
        for group in sorted({pair.group for pair in chosen})
    )
    used = {f: ramps[f] for group in groups for f in group}
    others = np.delete(np.arange(len(poses)), index)
    moved = motions.features(poses[others])

    def rule(rows: FloatArray) -> FloatArray:
        held = [[linear_ramp(rows[:, f], *used[f]) for f in group] for group in groups]
        return np.asarray(np.min([group_firing(group) for group in held], axis=0))

    movements = motions.features(motions.movements.single)
    negative, firing = negative_conditions(own, moved, rule, movements, errors, motions.twins)
    partly = (firing > LEAST_FIRING) & (firing <= _CONFUSED)
    shared = zip(others[partly].tolist(), firing[partly].tolist(), strict=True)
    confused = map(int, others[firing > _CONFUSED])
    return SelectedFeatures(used, groups, negative, tuple(confused), tuple(shared))


def _candidates(
    own: FloatArray, noise: FloatArray, motions: FaceMotions, apart: bool
) -> list[FeaturePair]:
    """Return the features that move clearly and strongly in the expression, with their twins.

    Where those are too few for a group, the strongest of the others that move clearly.
    """
    size, upper, twins = np.abs(own), motions.upper, motions.twins
    clear = exceeds_noise(size, noise, _LEAST_SIGNAL)
    largest = {half: size[upper == half].max(initial=0.0) for half in (True, False)}
    if not apart:
        still = [h for h, s in largest.items() if s < _HALF_MOVES * max(largest.values())]
        clear &= ~np.isin(upper, still)
    pairs: dict[int, list[tuple[float, FeaturePair]]] = {}
    for feature in np.flatnonzero(clear).tolist():
        twin, half = int(twins[feature]), bool(upper[feature])
        both = twin != feature and clear[twin] and size[twin] >= _EVEN * size[feature]
        if both and twin < feature:
            continue
        pair = FeaturePair((feature, twin) if both else (feature,), int(half) if apart else 0)
        share = float(size[list(pair.features)].min() / largest[half])
        pairs.setdefault(pair.group, []).append((share, pair))
    found: list[FeaturePair] = []
    for _, listed in sorted(pairs.items()):
        conditions, taken, last = 0, set(), 0.0
        for share, pair in sorted(
            listed, key=lambda each: (-round(each[0], _DIGITS), each[1].features)
        ):
            # All that are as strong as the last one: the order of the markers does not count.
            tied = round(share, _DIGITS) == last
            if share >= _STRONG or conditions < _ENOUGH or tied:
                conditions += len(pair.features)
                taken.add(pair)
                last = round(share, _DIGITS)
        found += [pair for _, pair in listed if pair in taken]
    return found


def _search(
    candidates: Sequence[FeaturePair],
    scene: TrialFaces,
    own: FloatArray,
    errors: FeatureErrors,
    apart: bool,
) -> list[FeaturePair]:
    """Return the candidates of least cost: greedily adding, replacing and dropping one at a time.

    A half of the face with too few of them for a group of its own is joined with the other, limited
    to as many: brows with two markers weigh as much as the mouth.
    """
    sizes = {p.group: 0 for p in candidates}
    for pair in candidates:
        sizes[pair.group] += len(pair.features)
    most, joined = 2 * (_MOST_PAIRS if apart else _MOST_PAIRS + _MORE_PAIRS), False
    if len(sizes) > 1 and min(sizes.values()) < FEWEST:
        most, joined = max(min(sizes.values()), 2), True
    cost = SelectionCost(candidates, scene, own, errors, joined)
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


def _changes(
    chosen: list[int], candidates: Sequence[FeaturePair], most: int
) -> Iterator[list[int]]:
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
