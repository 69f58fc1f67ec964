"""Separation of emotions by marker motions: sensitivity of each pair.

For two emotions and one feature the sensitivity is the distance of their means in units of
their spread (d' of signal detection: Green and Swets, "Signal Detection Theory and
Psychophysics", 1966); the spread is that of the examples, and never less than the markers'
noise. How many held-out examples are mistaken is counted with the three most sensitive
features of different markers, chosen without them; a threshold half-way decides.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.expression_system import MarkerFeature
from usdface.findings import Finding, finding
from usdface.rule_learning.cross_validation import Holding, folds
from usdface.rule_learning.examples import Examples

__all__ = ["Separation", "pose_separations", "separations"]

# As many features as a rule has conditions.
_FEATURES = 3
# Thresholds of MARKERS_CANNOT_SEPARATE. Below a d' of 2 a threshold half-way between the means
# mistakes more than one in six (the normal distribution beyond d' / 2 = 1). A quarter of held-out
# examples mistaken, as FIT_CONFUSED, and from how many on these decide: chosen by hand.
_LEAST_SENSITIVITY = 2.0
_LARGEST_SHARE = 0.25
_FEWEST_TESTED = 4
# Numerical guard for markers without noise: least scatter of examples [face unit].
_LEAST_SPREAD = 1e-6


@dataclass(frozen=True, slots=True)
class Separation:
    """Separation of two emotions.

    Attributes
    ----------
    emotions : (str, str)
    features : tuple of str
        The features that separate them best, the best first.
    sensitivity : float
        Of the best: distance of the means by the spread.
    mistaken, tested : int
        Held-out examples of the two that were taken for the other, and how many there were; 0 of
        poses of a rig.
    """

    emotions: tuple[str, str]
    features: tuple[str, ...]
    sensitivity: float
    mistaken: int
    tested: int

    @property
    def separated(self) -> bool:
        """Whether the markers distinguish the two emotions, as far as tested."""
        if self.tested >= _FEWEST_TESTED:
            return self.mistaken < _LARGEST_SHARE * self.tested
        return self.sensitivity >= _LEAST_SENSITIVITY

    def findings(self) -> list[Finding]:
        """Return MARKERS_CANNOT_SEPARATE, where it applies."""
        if self.separated:
            return []
        a, b = self.emotions
        best = self.features[0] if self.features else "none"
        message = "these markers cannot separate {expression} from {other}: "
        values: tuple[object, ...] = (a, b)
        if self.tested:
            message += "{mistaken_count} of {example_count} held-out examples are mistaken, and "
            values += (self.mistaken, self.tested)
        message += "by the best motion, {motion}, they lie {sensitivity:.1f} spreads apart"
        return [
            finding(
                "MARKERS_CANNOT_SEPARATE", f"{a}, {b}", message, *values, best, self.sensitivity
            )
        ]

    def as_dict(self) -> dict[str, Any]:
        """Return plain values for a report."""
        return {
            "emotions": list(self.emotions),
            "features": list(self.features),
            "sensitivity": round(self.sensitivity, 2),
            "mistaken": self.mistaken,
            "tested": self.tested,
            "separated": self.separated,
        }


def separations(examples: Examples, holding: Holding) -> list[Separation]:
    """Return the separation of every two emotions.

    Parameters
    ----------
    examples : Examples
        Features that are occluded in one of them do not count.
    holding : {"recording", "variant", "none"}
        The group that each fold holds out, as in `usdface.rule_learning.cross_validation`.
    """
    rows = {name: examples.rows(name) for name in examples.names}
    held_out_folds = list(folds(examples, holding))
    return [_pair(examples, pair, rows, held_out_folds) for pair in combinations(rows, 2)]


def pose_separations(
    names: Sequence[str], seen: FloatArray, noise: FloatArray, features: Sequence[MarkerFeature]
) -> list[Separation]:
    """Return the separation of every two poses of a rig, in units of the markers' noise.

    Parameters
    ----------
    names : sequence of str, length E
    seen : (E, 3 M) float64
        Features of each pose, x, y, z of each marker.
    noise : (3 M,) float64
        Of each feature, in the same unit.
    features : sequence of MarkerFeature, length 3 M
    """
    found = []
    for (one, a), (other, b) in combinations(zip(names, seen, strict=True), 2):
        best, sensitivity = _most_sensitive(a[None], b[None], noise)
        best_names = tuple(features[i].name for i in best)
        found.append(Separation((one, other), best_names, sensitivity, 0, 0))
    return found


def _pair(
    examples: Examples,
    pair: tuple[str, str],
    rows: dict[str, BoolArray],
    held_out_folds: Sequence[BoolArray],
) -> Separation:
    whole, noise = examples.whole, examples.noise
    first, second = (rows[name] for name in pair)
    best, sensitivity = _most_sensitive(whole[first], whole[second], noise)
    mistaken = tested = 0
    for held_out in held_out_folds:
        a, b = whole[first & ~held_out], whole[second & ~held_out]
        if not (len(a) and len(b)):
            continue
        chosen, _ = _most_sensitive(a, b, noise)
        for own, sign in ((first, 1), (second, -1)):
            side = sign * _side(whole[own & held_out], a, b, noise, chosen)
            mistaken += int((side <= 0).sum())
            tested += len(side)
    names = tuple(examples.marker_features[i].name for i in best)
    return Separation(pair, names, sensitivity, mistaken, tested)


def _spread(a: FloatArray, b: FloatArray, noise: FloatArray) -> FloatArray:
    squares = ((a - a.mean(axis=0)) ** 2).sum(axis=0) + ((b - b.mean(axis=0)) ** 2).sum(axis=0)
    scatter = squares / max(len(a) + len(b) - 2, 1)
    return np.asarray(np.sqrt(np.maximum(scatter, np.maximum(noise, _LEAST_SPREAD) ** 2)))


def _most_sensitive(a: FloatArray, b: FloatArray, noise: FloatArray) -> tuple[IntArray, float]:
    """Return the features, of different markers, whose means lie farthest apart; how far."""
    apart = np.abs(a.mean(axis=0) - b.mean(axis=0)) / _spread(a, b, noise)
    apart = np.nan_to_num(apart)
    order = np.argsort(-np.round(apart, 6), kind="stable")
    _, firsts = np.unique(order // 3, return_index=True)
    best = order[np.sort(firsts)[:_FEATURES]]
    return best, float(apart[best[0]])


def _side(
    faces: FloatArray, a: FloatArray, b: FloatArray, noise: FloatArray, chosen: IntArray
) -> FloatArray:
    """Return values above 0 for faces nearer to the mean of `a` than to that of `b`."""
    middle, apart = (a.mean(axis=0) + b.mean(axis=0)) / 2, a.mean(axis=0) - b.mean(axis=0)
    share = (faces - middle) * apart / _spread(a, b, noise) ** 2
    return np.asarray(np.nan_to_num(share[:, chosen]).sum(axis=1))
