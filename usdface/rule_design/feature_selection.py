"""Feature selection: which few marker motions, taken together, mean one expression.

A feature is one marker's displacement along one axis, relative to the nose tip; column
``3 * marker + axis`` of a (.., I) array, I = 3 M, in metres. A rival is a pose that must not
look like the expression: another expression, or a movement that means none.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from usdface.blend_shape_evaluator import BlendShapeEvaluator
from usdface.face.symmetry import mirrored_pairs
from usdface.rule_design.negative_conditions import FIRES, Ramp, exclude, ramp_degree
from usdface.takes import BoolArray, FloatArray, IntArray

__all__ = ["Choice", "choose_features", "paired_movements", "single_movements"]

# In standard deviations of a feature's noise.
_DEAD_ZONE = 0.1
_LEAST_SIGNAL = 4.0
# A dead zone of at least this share of the value at the pose, for markers without noise.
_LEAST_DEAD_ZONE = 0.02
# Nor does a feature that stays below this [m] count, however quiet the markers are.
_LEAST_MOTION = 1e-6
_TOP = 0.94
_CONDITIONS = 6
# Candidates of which all pairs are tried.
_SHORTLIST = 80
# Movements, the largest first, that are also tried two at a time.
_PAIRED = 100
# Costs of a full false firing: by another expression's pose, by one movement alone, by all pairs
# of movements together, by all other expressions with one more movement (a smile with raised brows
# is no fear), and by the worst of all these.
_OTHER_EXPRESSION = 60.0
_SINGLE_MOVEMENT = 20.0
_PAIRED_MOVEMENTS = 40.0
_VARIED_EXPRESSIONS = 40.0
_WORST = 4.0
# Cost of a feature whose signal is as small as its noise.
_NOISE_COST = 250.0
# Costs are rounded: which of two mirrored markers is taken must not hang on the last bits.
_DIGITS = 4
# An additional condition has to take away this share of the cost.
_LEAST_GAIN = 0.01
# Half a face, above or below the nose tip, is read where it moves by this share of the other half.
_HALF_MOVES = 0.5
# Expressions that fire another's rule further than this cannot be told apart.
_CONFUSED = 0.5


@dataclass(frozen=True, slots=True)
class Choice:
    """The features of one expression.

    Attributes
    ----------
    ramps : dict of int to (float, float)
        Feature to the signed values [m] where its term begins (the end of the dead zone around
        neutral) and where it holds fully (at the expression's pose). Empty = nothing shows it.
    excluded : tuple of (int, (float, float))
        Features and the ramps that they must not meet, see
        `usdface.rule_design.negative_conditions`.
    confused : tuple of int
        Other expressions that these features cannot tell from it.
    shared : tuple of (int, float)
        Other expressions that are taken for it a little, and how far: the rest of 1 is what is
        left for them.
    """

    ramps: dict[int, Ramp]
    excluded: tuple[tuple[int, Ramp], ...]
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
    paired = np.argsort(-np.abs(_shown(features, whole)).sum(axis=1), kind="stable")[:_PAIRED]
    first, second = (paired[i] for i in np.triu_indices(len(paired), k=1))
    return np.asarray(whole[first] + whole[second])


def choose_features(
    index: int,
    poses: FloatArray,
    single: FloatArray,
    paired: FloatArray,
    features: BlendShapeEvaluator,
    noise: FloatArray,
    upper: BoolArray,
) -> Choice:
    """Choose the features that show one expression and none of its rivals.

    Parameters
    ----------
    index : int
        Which expression.
    poses : (E, S) float64
        All expression poses.
    single, paired : (N, S), (P, S) float64
        What a face may do without meaning an emotion, see `single_movements` and
        `paired_movements`. What contains the whole expression is no rival.
    features : BlendShapeEvaluator
        Of the features, N = I.
    noise : (I,) float64 [m]
        Standard deviation of each feature.
    upper : (I,) bool
        Features of markers above the nose tip.
    """
    own = _shown(features, poses[index : index + 1])[0]
    full = np.abs(own)
    foot = np.sign(own) * np.maximum(_DEAD_ZONE * noise, _LEAST_DEAD_ZONE * full)
    usable = np.flatnonzero(full > np.maximum(_LEAST_SIGNAL * noise, _LEAST_MOTION))
    if not usable.size:
        return Choice({}, (), ())
    others = np.delete(np.arange(len(poses)), index)
    alone, both = (m[(m < np.sign(poses[index])).any(axis=1)] for m in (single, paired))
    varied = (poses[others][:, None] + single).reshape(-1, poses.shape[1])
    varied = varied[(varied < poses[index]).any(axis=1)]
    rivals = _shown(features.select(usable), np.concatenate([poses[others], alone, both, varied]))
    degrees = ramp_degree(rivals, foot[usable], _TOP * own[usable])
    costs = (
        _OTHER_EXPRESSION,
        _SINGLE_MOVEMENT,
        _PAIRED_MOVEMENTS / max(len(both), 1),
        _VARIED_EXPRESSIONS / max(len(varied), 1),
    )
    weights = np.repeat(costs, (len(others), len(alone), len(both), len(varied)))
    noisy = np.round(_NOISE_COST * (noise[usable] / full[usable]) ** 2, _DIGITS)
    chosen = _cheapest(degrees, weights, noisy, usable // 3)
    chosen += _unread_half(chosen, full[usable], noisy, upper[usable])
    ramps = {int(i): (float(foot[i]), _TOP * float(own[i])) for i in usable[chosen]}
    firing = degrees[: len(others), chosen].min(axis=1)
    moved = _shown(features, poses[others])
    excluded, firing = exclude(own, moved, firing, ramps, _shown(features, single), noise)
    partly = (firing > FIRES) & (firing <= _CONFUSED)
    shared = zip(others[partly].tolist(), firing[partly].tolist(), strict=True)
    confused = map(int, others[firing > _CONFUSED])
    return Choice(ramps, excluded, tuple(confused), tuple(shared))


def _shown(features: BlendShapeEvaluator, weights: FloatArray) -> FloatArray:
    """Return the features of faces with some weights (N, S): (N, I) [m]."""
    return features.displacements(features.combined(weights))


def _cheapest(
    degrees: FloatArray, weights: FloatArray, cost: FloatArray, marker: IntArray
) -> list[int]:
    """Return the features whose conjunction is met least by rival poses, at little noise.

    The best pair, then one by one as long as it pays.

    Parameters
    ----------
    degrees : (P, C) float64
        How far each rival pose meets each candidate's term.
    weights : (P,) float64
    cost : (C,) float64
        Of the noise of each candidate; a conjunction is as noisy as its noisiest.
    marker : (C,) int64
        A marker is used once.
    """
    single = _cost(degrees, weights) + cost
    best = np.argsort(single, kind="stable")[:_SHORTLIST]
    short = degrees[:, best]
    pairs = np.array([_cost(np.minimum(short, one[:, None]), weights) for one in short.T])
    pairs += np.maximum(cost[best][:, None], cost[best])
    pairs[marker[best][:, None] == marker[best]] = np.inf
    a, b = np.unravel_index(np.argmin(pairs), pairs.shape)
    if not pairs[a, b] < (1 - _LEAST_GAIN) * single[best[0]]:
        return [int(best[0])]
    chosen, total = [int(best[a]), int(best[b])], pairs[a, b]
    while len(chosen) < _CONDITIONS:
        met = degrees[:, chosen].min(axis=1)
        totals = _cost(np.minimum(degrees, met[:, None]), weights)
        totals += np.maximum(cost, cost[chosen].max())
        totals[np.isin(marker, marker[chosen])] = np.inf
        following = int(np.argmin(totals))
        if not totals[following] < (1 - _LEAST_GAIN) * total:
            break
        chosen, total = [*chosen, following], totals[following]
    return chosen


def _unread_half(
    chosen: list[int], full: FloatArray, cost: FloatArray, upper: BoolArray
) -> list[int]:
    """Return the clearest feature of the half of the face that none is chosen of, if it moves much.

    Rivals of one or two movements may not ask for it, but faces do more at once: a laughing mouth
    holds all of fear's, and it is the brows that tell.

    Parameters
    ----------
    chosen : list of int
        Of the candidates.
    full, cost : (C,) float64
        How far each candidate moves in the expression [m], and what its noise costs.
    upper : (C,) bool
    """
    for half in (upper, ~upper):
        if half.any() and not half[chosen].any():
            moves = full[half].max() >= _HALF_MOVES * full[~half].max(initial=0.0)
            return [int(np.argmin(np.where(half, cost, np.inf)))] if moves else []
    return []


def _cost(degrees: FloatArray, weights: FloatArray) -> FloatArray:
    """Return what the firing (P, C) of rivals costs: all together, and the worst of them."""
    squares = degrees**2
    cost = weights @ squares + _WORST * squares.max(axis=0, initial=0.0)
    return np.asarray(np.round(cost, _DIGITS))
