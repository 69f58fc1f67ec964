"""The cost of selected features: missed and false firing, error, and missing conditions."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from usdface.arrays import FloatArray
from usdface.fuzzy.norms import most_of
from usdface.numerics.ramps import linear_ramp
from usdface.rule_design.feature_errors import FeatureErrors
from usdface.rule_design.negative_conditions import Ramp
from usdface.rule_design.trial_faces import TrialFaces

__all__ = ["FEWEST", "FeaturePair", "SelectionCost", "feature_ramps", "group_firing"]

# Fewer conditions than this are joined by AND: of two, most are both.
FEWEST = 3

# Tuned by hand against benchmarks/expressions.py and benchmarks/expression_takes.py, which judge
# them, unless noted otherwise; see docs/constants.md.
# Shares of the value at the pose: where a term begins (dead zone), and where it holds fully.
_DEAD_ZONE = 0.02
_TOP = 0.94
# Smallest motion [m] that the error of a feature is divided by.
_LEAST_MOTION = 0.0005
# Cost of a feature whose motion is as small as its error.
_ERROR_COST = 40.0
# Fewer conditions than `_ENOUGH` cost something each: of five one may be wrong.
_ENOUGH, _MISSING_COST, _SAME_MARKER_COST = 5, 12.0, 0.3
# Fewer than `FEWEST` only where there are no more.
_TOO_FEW_COST = 1000.0
# Cost of firing at the worst of all rivals.
_WORST = 3.0
# Numerical: costs are rounded, as the choice between equal features must not hang on last bits.
_DIGITS = 4


@dataclass(frozen=True, slots=True)
class FeaturePair:
    """A candidate: a feature, or it and its twin, and the group that it belongs to."""

    features: tuple[int, ...]
    group: int


def group_firing(memberships: Sequence[FloatArray]) -> FloatArray:
    """Return how far a group of conditions holds, from their memberships (N,) each."""
    if len(memberships) < FEWEST:
        return np.asarray(np.min(memberships, axis=0))
    return most_of(memberships)


def feature_ramps(own: FloatArray) -> list[Ramp]:
    """Return the ramp of each feature by its value (I,) in the expression's own pose."""
    return [(float(_DEAD_ZONE * value), float(_TOP * value)) for value in own]


class SelectionCost:
    """The cost of selected candidates: missed and false firing, error, and missing conditions."""

    def __init__(
        self,
        candidates: Sequence[FeaturePair],
        scene: TrialFaces,
        own: FloatArray,
        errors: FeatureErrors,
        joined: bool,
    ) -> None:
        self._scene = scene
        self._groups = [0 if joined else pair.group for pair in candidates]
        self._all = sorted(set(self._groups))
        self._counts = [len(pair.features) for pair in candidates]
        self._markers = [pair.features[0] // 3 for pair in candidates]
        error = errors.total / np.maximum(np.abs(own), _LEAST_MOTION)
        self._error = np.array([(error[list(p.features)] ** 2).max() for p in candidates])
        ramps = feature_ramps(own)

        def met(rows: FloatArray) -> list[list[FloatArray]]:
            return [[linear_ramp(rows[:, f], *ramps[f]) for f in p.features] for p in candidates]

        self._wanted, self._rivals = met(scene.wanted), met(scene.rivals)
        self._known: dict[frozenset[int], tuple[FloatArray, FloatArray]] = {}

    def __call__(self, chosen: Sequence[int]) -> float:
        """Return the cost of the candidates `chosen`."""
        groups: dict[int, list[int]] = {group: [] for group in self._all}
        for k in chosen:
            groups[self._groups[k]].append(k)
        wanted, rivals = (
            np.min(parts, axis=0) for parts in zip(*self._firing(groups), strict=True)
        )
        squares = rivals**2
        cost = self._scene.rival_costs @ squares + _WORST * squares.max(initial=0.0)
        cost += self._scene.wanted_costs @ (1 - wanted) ** 2
        cost += _ERROR_COST * self._error[list(chosen)].mean()
        for own in groups.values():
            conditions = sum(self._counts[k] for k in own)
            cost += _MISSING_COST * max(0, _ENOUGH - conditions)
            cost += _TOO_FEW_COST * max(0, FEWEST - conditions)
        cost += _SAME_MARKER_COST * (len(chosen) - len({self._markers[k] for k in chosen}))
        return round(float(cost), _DIGITS)

    def _firing(self, groups: Mapping[int, list[int]]) -> list[tuple[FloatArray, FloatArray]]:
        """Return how far each group holds on the wanted faces and on the rivals.

        A change of one group leaves the other as it was: each is computed once.
        """
        found = []
        for own in filter(None, groups.values()):
            key = frozenset(own)
            if key not in self._known:
                self._known[key] = (
                    group_firing([m for k in own for m in self._wanted[k]]),
                    group_firing([m for k in own for m in self._rivals[k]]),
                )
            found.append(self._known[key])
        return found
