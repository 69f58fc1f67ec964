"""Feature selection: a few marker motions that together distinguish one expression.

A feature is one marker's displacement along one axis, relative to the nose tip; column
``3 * marker + axis`` of a (.., I) array, I = 3 M, in metres. A rival is a pose that must not
look like the expression: another expression, or a movement without emotion.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.blend_shape_evaluator import BlendShapeEvaluator
from usdface.face.symmetry import mirrored_pairs
from usdface.rule_design.feature_noise import exceeds_noise
from usdface.rule_design.negative_conditions import (
    LEAST_FIRING,
    Ramp,
    negative_conditions,
    ramp_membership,
)

__all__ = ["SelectedFeatures", "paired_movements", "select_features", "single_movements"]

# Tuned by hand against benchmarks/expressions.py, which judges them, unless noted otherwise; see
# docs/constants.md.
# In standard deviations of a feature's noise: a term jitters by a quarter of its reach at most.
_LEAST_SIGNAL = 4.0
# Shares of the value at the pose: where a term begins (dead zone), and where it holds fully.
_DEAD_ZONE = 0.02
_TOP = 0.94
# Longest readable conjunction; twice as many would change 2 of the 48 rules
# of benchmarks/expressions.py.
_CONDITIONS = 6
# Limits of time and memory: candidates of which all pairs are tried, and movements, the largest
# first, that are also tried two at a time. No rule of the benchmark changes with more movements.
_SHORTLIST = 80
_PAIRED = 100
# Costs of a full false firing: by another expression's pose, by one movement alone, by all pairs
# of movements together as by all other expressions with one more movement (a smile with raised
# brows is no fear), and by the worst of all these. Only their ratios to _NOISE_COST count.
_OTHER_EXPRESSION = 60.0
_SINGLE_MOVEMENT = 20.0
_COMBINED_MOVEMENTS = 40.0
_WORST = 4.0
# Cost of a feature whose signal is as small as its noise.
_NOISE_COST = 250.0
# Numerical: costs are rounded, as the choice between mirrored markers must not hang on last bits.
_DIGITS = 4
# An additional condition has to take away this share of the cost.
_LEAST_GAIN = 0.01
# Least motion of the upper or lower half of the face that is read, as a share of the other half's.
_HALF_MOVES = 0.5
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
    negative: tuple[tuple[int, Ramp], ...]
    confused: tuple[int, ...]
    shared: tuple[tuple[int, float], ...] = ()


def single_movements(shape_names: Sequence[str]) -> FloatArray:
    """Return each blend shape alone, and those of both sides together: (N, S)."""
    alone = np.eye(len(shape_names))
    both = alone[mirrored_pairs(tuple(shape_names))].sum(axis=1)
    return np.concatenate([alone, both])


def paired_movements(
    shape_names: Sequence[str], single: FloatArray, features: BlendShapeEvaluator
) -> FloatArray:
    """Return two of the `single_movements` at a time, of those that move the markers most: (P, S).

    Parameters
    ----------
    shape_names : sequence of str, length S
    single : (N, S) float64
    features : BlendShapeEvaluator
        Of the features, N = I.
    """
    sided = (single[len(shape_names) :] > 0).any(axis=0)
    whole = single[~((single.sum(axis=1) == 1) & (single @ sided > 0))]
    paired = np.argsort(-np.abs(_features_at(features, whole)).sum(axis=1), kind="stable")[:_PAIRED]
    first, second = (paired[i] for i in np.triu_indices(len(paired), k=1))
    return np.asarray(whole[first] + whole[second])


def select_features(
    index: int,
    poses: FloatArray,
    single: FloatArray,
    paired: FloatArray,
    features: BlendShapeEvaluator,
    noise: FloatArray,
    upper: BoolArray,
) -> SelectedFeatures:
    """Choose the features that show one expression and none of its rivals.

    Parameters
    ----------
    index : int
        Row of the expression in `poses`.
    poses : (E, S) float64
        All expression poses.
    single, paired : (N, S), (P, S) float64
        Movements without emotion, see `single_movements` and `paired_movements`. Those that contain
        the whole expression are no rivals.
    features : BlendShapeEvaluator
        Of the features, N = I.
    noise : (I,) float64 [m]
        Standard deviation of each feature.
    upper : (I,) bool
        Features of markers above the nose tip.
    """
    own = _features_at(features, poses[index : index + 1])[0]
    full = np.abs(own)
    foot = _DEAD_ZONE * own
    usable = np.flatnonzero(exceeds_noise(full, noise, _LEAST_SIGNAL))
    if not usable.size:
        return SelectedFeatures({}, (), ())
    others = np.delete(np.arange(len(poses)), index)
    alone, both = (m[(m < np.sign(poses[index])).any(axis=1)] for m in (single, paired))
    varied = (poses[others][:, None] + single).reshape(-1, poses.shape[1])
    varied = varied[(varied < poses[index]).any(axis=1)]
    rivals = _features_at(
        features.select(usable), np.concatenate([poses[others], alone, both, varied])
    )
    memberships = ramp_membership(rivals, foot[usable], _TOP * own[usable])
    costs = (
        _OTHER_EXPRESSION,
        _SINGLE_MOVEMENT,
        _COMBINED_MOVEMENTS / max(len(both), 1),
        _COMBINED_MOVEMENTS / max(len(varied), 1),
    )
    weights = np.repeat(costs, (len(others), len(alone), len(both), len(varied)))
    noisy = np.round(_NOISE_COST * (noise[usable] / full[usable]) ** 2, _DIGITS)
    chosen = _cheapest(memberships, weights, noisy, usable // 3)
    chosen += _missing_half(chosen, full[usable], noisy, upper[usable])
    ramps = {int(i): (float(foot[i]), _TOP * float(own[i])) for i in usable[chosen]}
    firing = memberships[: len(others), chosen].min(axis=1)
    moved, movements = _features_at(features, poses[others]), _features_at(features, single)
    negative, firing = negative_conditions(own, moved, firing, ramps, movements, noise)
    partly = (firing > LEAST_FIRING) & (firing <= _CONFUSED)
    shared = zip(others[partly].tolist(), firing[partly].tolist(), strict=True)
    confused = map(int, others[firing > _CONFUSED])
    return SelectedFeatures(ramps, negative, tuple(confused), tuple(shared))


def _features_at(features: BlendShapeEvaluator, weights: FloatArray) -> FloatArray:
    """Return the features of a face at weights (N, S): (N, I) [m]."""
    return features.displacements(features.combined(weights))


def _cheapest(
    memberships: FloatArray, weights: FloatArray, cost: FloatArray, marker: IntArray
) -> list[int]:
    """Return the features whose conjunction rival poses meet least, at little noise.

    The best pair, then one by one as long as the cost falls enough.

    Parameters
    ----------
    memberships : (P, C) float64
        Of each rival pose in each candidate's term.
    weights : (P,) float64
    cost : (C,) float64
        Of the noise of each candidate; a conjunction is as noisy as its noisiest.
    marker : (C,) int64
        A marker is used once.
    """
    single = _cost(memberships, weights) + cost
    best = np.argsort(single, kind="stable")[:_SHORTLIST]
    short = memberships[:, best]
    pairs = np.array([_cost(np.minimum(short, one[:, None]), weights) for one in short.T])
    pairs += np.maximum(cost[best][:, None], cost[best])
    pairs[marker[best][:, None] == marker[best]] = np.inf
    a, b = np.unravel_index(np.argmin(pairs), pairs.shape)
    if not pairs[a, b] < (1 - _LEAST_GAIN) * single[best[0]]:
        return [int(best[0])]
    chosen, total = [int(best[a]), int(best[b])], pairs[a, b]
    while len(chosen) < _CONDITIONS:
        met = memberships[:, chosen].min(axis=1)
        totals = _cost(np.minimum(memberships, met[:, None]), weights)
        totals += np.maximum(cost, cost[chosen].max())
        totals[np.isin(marker, marker[chosen])] = np.inf
        following = int(np.argmin(totals))
        if not totals[following] < (1 - _LEAST_GAIN) * total:
            break
        chosen, total = [*chosen, following], totals[following]
    return chosen


def _missing_half(
    chosen: list[int], full: FloatArray, cost: FloatArray, upper: BoolArray
) -> list[int]:
    """Return the clearest feature of an upper or lower half without one, if it moves much.

    Rivals of one or two movements may not need it, but faces combine more: a laughing mouth has all
    features of a fearful one, and only the brows distinguish the two.

    Parameters
    ----------
    chosen : list of int
        Of the candidates.
    full, cost : (C,) float64
        Motion of each candidate in the expression [m], and the cost of its noise.
    upper : (C,) bool
    """
    for half in (upper, ~upper):
        if half.any() and not half[chosen].any():
            moves = full[half].max() >= _HALF_MOVES * full[~half].max(initial=0.0)
            return [int(np.argmin(np.where(half, cost, np.inf)))] if moves else []
    return []


def _cost(memberships: FloatArray, weights: FloatArray) -> FloatArray:
    """Return the cost (C,) of rivals' firing strengths (P, C): their sum, and the worst of them."""
    squares = memberships**2
    cost = weights @ squares + _WORST * squares.max(axis=0, initial=0.0)
    return np.asarray(np.round(cost, _DIGITS))
