"""Feature selection: which few marker motions, taken together, mean one expression.

A feature is one marker's displacement along one axis, relative to the nose tip; column
``3 * marker + axis`` of a (.., I) array, I = 3 M, in metres. A rival is a pose that must not
look like the expression: another expression, or a movement that means none.
"""

import re
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from usdface.takes import FloatArray, IntArray

__all__ = ["Choice", "choose_features", "movements"]

# What the names of a shape on either side differ in: mouthSmileLeft, mouthSmile_L, eye-left-slit.
_SIDE = re.compile(r"(?i)left|right|(?<=[_.\- ])[lr]$|^[lr](?=[_.\- ])")
# In standard deviations of a feature's noise.
_DEAD_ZONE = 0.8
_LEAST_SIGNAL = 4.0
# A dead zone of at least this share of the value at the pose, for markers without noise.
_LEAST_DEAD_ZONE = 0.05
# Nor does a feature that stays below this [m] count, however quiet the markers are.
_LEAST_MOTION = 1e-6
_CONDITIONS = 4
# Candidates of which all pairs are tried.
_SHORTLIST = 80
# Movements, the largest first, that are also tried two at a time.
_PAIRED = 100
# Costs of a full false firing: by another expression's pose, and by all movements together.
_OTHER_EXPRESSION = 20.0
_MOVEMENT = 40.0
# Cost of a feature whose signal is as small as its noise.
_NOISE_COST = 30.0
# An additional condition has to take away this share of the cost.
_LEAST_GAIN = 0.02
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
    confused : tuple of int
        Other expressions that these features cannot tell from it.
    """

    ramps: dict[int, tuple[float, float]]
    confused: tuple[int, ...]


def movements(shape_names: Sequence[str], features: FloatArray) -> FloatArray:
    """Return what a face may do without meaning an emotion, as weights: (P, S).

    Each blend shape alone; shapes that differ only in their side, together; two of these, of
    those that move the markers most.

    Parameters
    ----------
    shape_names : sequence of str, length S
    features : (S, I) float64 [m]
        Of each blend shape at weight 1.
    """
    alone = np.eye(len(shape_names))
    groups: dict[str, list[int]] = defaultdict(list)
    for i, name in enumerate(shape_names):
        groups[_SIDE.sub("*", name)].append(i)
    both = np.array([alone[group].sum(axis=0) for group in groups.values()])
    both = both.reshape(len(groups), len(alone))
    paired = np.argsort(-np.abs(both @ features).sum(axis=1), kind="stable")[:_PAIRED]
    first, second = (paired[i] for i in np.triu_indices(len(paired), k=1))
    return np.concatenate([alone, both, both[first] + both[second]])


def choose_features(
    index: int, poses: FloatArray, moves: FloatArray, features: FloatArray, noise: float
) -> Choice:
    """Choose the features that show one expression and none of its rivals.

    Parameters
    ----------
    index : int
        Which expression.
    poses : (E, S) float64
        All expression poses.
    moves : (P, S) float64
        See `movements`; those that contain the whole expression are no rivals.
    features : (S, I) float64 [m]
        Of each blend shape at weight 1.
    noise : float [m]
        Standard deviation of a feature.
    """
    own = poses[index] @ features
    full = np.abs(own)
    dead = np.maximum(_DEAD_ZONE * noise, _LEAST_DEAD_ZONE * full)
    usable = np.flatnonzero(full > max(_LEAST_SIGNAL * noise, _LEAST_MOTION))
    if not usable.size:
        return Choice({}, ())
    others = np.delete(np.arange(len(poses)), index)
    partial = moves[(moves < np.sign(poses[index])).any(axis=1)]
    rivals = np.concatenate([poses[others], partial]) @ features[:, usable]
    degrees = np.clip((rivals * np.sign(own[usable]) - dead[usable]) / (full - dead)[usable], 0, 1)
    weights = np.full(len(rivals), _MOVEMENT / max(len(partial), 1))
    weights[: len(others)] = _OTHER_EXPRESSION
    chosen = _cheapest(degrees, weights, _NOISE_COST * (noise / full[usable]) ** 2, usable // 3)
    firing = degrees[: len(others), chosen].min(axis=1)
    ramps = {int(i): (float(np.sign(own[i]) * dead[i]), float(own[i])) for i in usable[chosen]}
    return Choice(ramps, tuple(map(int, others[firing > _CONFUSED])))


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
    single = weights @ degrees**2 + cost
    best = np.argsort(single, kind="stable")[:_SHORTLIST]
    short = degrees[:, best]
    pairs = np.array([weights @ np.minimum(short, one[:, None]) ** 2 for one in short.T])
    pairs += np.maximum(cost[best][:, None], cost[best])
    pairs[marker[best][:, None] == marker[best]] = np.inf
    a, b = np.unravel_index(np.argmin(pairs), pairs.shape)
    if not pairs[a, b] < (1 - _LEAST_GAIN) * single[best[0]]:
        return [int(best[0])]
    chosen, total = [int(best[a]), int(best[b])], pairs[a, b]
    while len(chosen) < _CONDITIONS:
        met = degrees[:, chosen].min(axis=1)
        totals = weights @ np.minimum(degrees, met[:, None]) ** 2
        totals += np.maximum(cost, cost[chosen].max())
        totals[np.isin(marker, marker[chosen])] = np.inf
        following = int(np.argmin(totals))
        if not totals[following] < (1 - _LEAST_GAIN) * total:
            break
        chosen, total = [*chosen, following], totals[following]
    return chosen
