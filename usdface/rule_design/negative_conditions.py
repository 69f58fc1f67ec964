"""Negative conditions: features of another expression that the expression itself lacks.

Where all features of one expression also move in another (fear is most of sadness with raised
brows), no conjunction of them distinguishes the two. A negated condition does: IS NOT a term of the
other expression only.
"""

from collections.abc import Mapping

import numpy as np

from usdface.arrays import FloatArray
from usdface.rule_design.feature_noise import exceeds_noise

__all__ = ["LEAST_FIRING", "Ramp", "negative_conditions", "ramp_membership"]

# Signed values of a feature [m]: the membership is 0 up to the first, 1 from the second on.
Ramp = tuple[float, float]

# Tuned by hand against benchmarks/expressions.py, which judges them, unless noted otherwise; see
# docs/constants.md.
# Another expression that fires a rule by no more than this is accepted: the bound of that benchmark
# for outputs.
LEAST_FIRING = 0.1
# A feature excludes where the other expression moves it by this many standard deviations of noise.
_CLEAR = 6.0
# Its term begins and ends at these shares of that motion: early, since half of the other expression
# fires half of the rule.
_BEGIN, _END = 0.1, 0.4
# Intensities of the other expression at which the remaining firing is evaluated: steps of 5 %.
_INTENSITIES = np.linspace(0.0, 1.0, 21)
# A condition has to leave no more than this share of the firing strength.
_REMAINS = 0.5
# Numerical: scores and motions [m] are rounded, as the choice between mirrored markers must not
# hang on last bits.
_SCORE_DIGITS, _MOTION_DIGITS = 3, 6


def ramp_membership(x: FloatArray, foot: FloatArray | float, top: FloatArray | float) -> FloatArray:
    """Return the membership in a ramp, on either side of 0: 0 at the foot, 1 from the top on."""
    return np.asarray(np.clip((x - foot) / (top - foot), 0.0, 1.0))


def negative_conditions(
    own: FloatArray,
    others: FloatArray,
    firing: FloatArray,
    ramps: Mapping[int, Ramp],
    single: FloatArray,
    noise: FloatArray,
) -> tuple[tuple[tuple[int, Ramp], ...], FloatArray]:
    """Choose a negated condition for each other expression that fires the rule.

    Parameters
    ----------
    own, others : (I,), (E, I) float64 [m]
        Features of the expression and of other ones, at their poses.
    firing : (E,) float64
        Firing strength of the rule at the others' poses.
    ramps : mapping of int to (float, float)
        The rule's features.
    single : (N, I) float64 [m]
        Features of single movements, weighted by their size: speech moves the jaw.
    noise : (I,) float64 [m]
        Standard deviation of each feature.

    Returns
    -------
    excluded : tuple of (int, (float, float))
        Features and the ramps of their negated conditions; empty if none helps.
    firing : (E,) float64
        The firing strength with these conditions.
    """
    excluded = []
    for strongest in np.argsort(-firing, kind="stable"):
        if firing[strongest] <= LEAST_FIRING:
            break
        found = _condition(own, others[strongest], ramps, single, noise)
        if found is not None:
            feature, ramp = found
            excluded.append(found)
            firing = np.minimum(firing, 1.0 - ramp_membership(others[:, feature], *ramp))
    return tuple(excluded), firing


def _condition(
    own: FloatArray,
    other: FloatArray,
    ramps: Mapping[int, Ramp],
    single: FloatArray,
    noise: FloatArray,
) -> tuple[int, Ramp] | None:
    """Choose the feature that best distinguishes the `other` pose (I,) from the `own` one.

    It leaves the least firing strength at any intensity of the other expression, suppresses the
    expression least under an additional movement, and has little noise. Of equals, the largest
    motion.
    """
    motion = np.abs(other)
    clear = exceeds_noise(motion, noise, _CLEAR)
    usable = np.flatnonzero(clear & (own * np.sign(other) <= _BEGIN * motion))
    if not usable.size:
        return None
    foot, top = _BEGIN * other[usable], _END * other[usable]
    fired = np.min([ramp_membership(_INTENSITIES * other[i], *r) for i, r in ramps.items()], axis=0)
    excluded = ramp_membership(_INTENSITIES[:, None] * other[usable], foot, top)
    remaining = np.minimum(fired[:, None], 1.0 - excluded).max(axis=0)
    share = np.linalg.norm(single, axis=1)
    share /= max(share.sum(), np.finfo(np.float64).tiny)
    suppressed = share @ ramp_membership(own[usable] + single[:, usable], foot, top)
    score = np.round(remaining + suppressed + noise[usable] / motion[usable], _SCORE_DIGITS)
    best = np.lexsort((-np.round(motion[usable], _MOTION_DIGITS), score))[0]
    if remaining[best] > _REMAINS * fired.max():
        return None
    return int(usable[best]), (float(foot[best]), float(top[best]))
