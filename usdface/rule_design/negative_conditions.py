"""Negative conditions: features of another expression that the expression itself lacks.

Where all features of one expression also move in another (fear is most of sadness with raised
brows), no conjunction of them distinguishes the two. A negated condition does: NOT a feature of
the other expression only, on both sides of the face where it has two, so that one marker alone
suppresses no rule.
"""

from collections.abc import Callable

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.numerics.ramps import linear_ramp
from usdface.rule_design.feature_errors import FeatureErrors
from usdface.rule_design.feature_noise import exceeds_noise

__all__ = [
    "LEAST_FIRING",
    "NegativeCondition",
    "Ramp",
    "negative_conditions",
    "suppression",
]

# Signed values of a feature [m]: the membership is 0 up to the first, 1 from the second on.
Ramp = tuple[float, float]
# Features and their ramps; a rule is suppressed by the smallest of their memberships.
NegativeCondition = tuple[tuple[int, Ramp], ...]

# Tuned by hand against benchmarks/expressions.py, which judges them, unless noted otherwise; see
# docs/constants.md.
# Another expression that fires a rule by no more than this is accepted: the bound of that benchmark
# for outputs.
LEAST_FIRING = 0.1
# A feature excludes where the other expression moves it by this many standard deviations of noise.
_CLEAR = 4.0
# Its term begins and ends at these shares of that motion: early, since half of the other expression
# fires half of the rule.
_BEGIN, _END = 0.1, 0.4
# Intensities of the other expression at which the remaining firing is evaluated: steps of 5 %.
_INTENSITIES = np.linspace(0.0, 1.0, 21)
# A condition has to leave no more than this share of the firing strength.
_REMAINS = 0.75
# Cost of a feature whose motion is as small as its error: of conditions that exclude alike, the
# larger motion.
_ERROR_COST = 0.02
# Numerical: scores and motions [m] are rounded, as the choice between mirrored markers must not
# hang on last bits.
_SCORE_DIGITS, _MOTION_DIGITS = 3, 6


def negative_conditions(
    own: FloatArray,
    others: FloatArray,
    rule: Callable[[FloatArray], FloatArray],
    single: FloatArray,
    errors: FeatureErrors,
    twins: IntArray,
) -> tuple[tuple[NegativeCondition, ...], FloatArray]:
    """Choose a negated condition for each other expression that fires the rule.

    Parameters
    ----------
    own, others : (I,), (E, I) float64 [m]
        Features of the expression and of other ones, at their poses.
    rule : function
        How far the rule fires (N,) on features (N, I).
    single : (N, I) float64 [m]
        Features of single movements, weighted by their size: speech moves the jaw.
    errors : FeatureErrors
        At the expression's pose.
    twins : (I,) int64
        The feature on the other side; itself where there is none.

    Returns
    -------
    excluded : tuple of NegativeCondition
        Empty if none helps.
    firing : (E,) float64
        The firing strength with these conditions.
    """
    excluded, firing = [], rule(others)
    for strongest in np.argsort(-firing, kind="stable"):
        if firing[strongest] <= LEAST_FIRING:
            break
        found = _condition(own, others[strongest], rule, single, errors, twins)
        if found is not None:
            excluded.append(found)
            firing = np.minimum(firing, 1.0 - suppression(others, found))
    return tuple(excluded), firing


def suppression(rows: FloatArray, condition: NegativeCondition) -> FloatArray:
    """Return how far a negative condition suppresses a rule on features (N, I): (N,)."""
    return np.asarray(np.min([linear_ramp(rows[:, f], *ramp) for f, ramp in condition], axis=0))


def _condition(
    own: FloatArray,
    other: FloatArray,
    rule: Callable[[FloatArray], FloatArray],
    single: FloatArray,
    errors: FeatureErrors,
    twins: IntArray,
) -> NegativeCondition | None:
    """Choose the feature, with its twin, that best distinguishes the `other` pose (I,).

    It leaves the least firing strength at any intensity of the other expression, suppresses the
    expression least under an additional movement, and is large against its error. Of equals, the
    largest motion.
    """
    motion = np.abs(other)
    usable = exceeds_noise(motion, errors.noise, _CLEAR) & (own * np.sign(other) <= _BEGIN * motion)
    if not usable.any():
        return None
    partner = np.where(usable[twins], twins, np.arange(len(own)))
    candidates = [(f, int(partner[f])) for f in np.flatnonzero(usable).tolist() if partner[f] >= f]
    conditions = [
        tuple((f, (float(_BEGIN * other[f]), float(_END * other[f]))) for f in dict.fromkeys(pair))
        for pair in candidates
    ]
    scaled = _INTENSITIES[:, None] * other
    fired = rule(scaled)
    share = np.linalg.norm(single, axis=1)
    share /= max(share.sum(), np.finfo(np.float64).tiny)
    scores = []
    for condition in conditions:
        remaining = float(np.minimum(fired, 1.0 - suppression(scaled, condition)).max())
        suppressed = float(share @ suppression(own + single, condition))
        weakest = min(motion[f] for f, _ in condition)
        unsure = _ERROR_COST * max(errors.total[f] / motion[f] for f, _ in condition)
        score = round(remaining + suppressed + unsure, _SCORE_DIGITS)
        scores.append((score, -round(float(weakest), _MOTION_DIGITS), remaining))
    best = min(range(len(scores)), key=lambda k: scores[k][:2])
    if scores[best][2] > _REMAINS * fired.max():
        return None
    return conditions[best]
