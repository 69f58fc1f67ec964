"""Posterior of the gains of a performer's movements, from their peaks in a take.

A take alone cannot tell a small smile from a low gain: only the product of gain and weight moves
the markers. A peak p of that product says that the weight there was at most 1, so that the gain is
p or more. Where the performer went to the extreme, the weight there was 1, and the gain is p. Both
are likelihoods of it; with its prior they give a posterior on a grid.

How much gains differ at all is a trait of the performer, which all extremes of a range of motion
show together: where they lie near 1, those that are seen badly do, too (a hierarchical prior:
Gelman et al., "Bayesian Data Analysis", 3rd edition, chapter 5).
"""

import numpy as np
from scipy.special import ndtr, softmax

from usdface.arrays import FloatArray
from usdface.options import PERFORMER_GAIN_RANGE, PERFORMER_GAIN_SPREAD

__all__ = ["gain_posterior"]

_GRID = np.linspace(*PERFORMER_GAIN_RANGE, 301)  # steps of 0.005, a fortieth of the usual deviation
# An extreme is repeated to within this share. Set by hand.
_REACH = 0.05
# Peaks of weights that are no extremes are anywhere, on a logarithmic scale, from this to 1: two
# deviations of a weight at 0.3 mm of noise (0.023, docs/measurements.md).
_LEAST = 0.05
# Standard deviations of a performer's gains that are compared, each as likely as the others:
# ten, from this share of the usual one on. Set by hand.
_LEAST_SPREAD = 0.1


def gain_posterior(
    peaks: FloatArray, deviations: FloatArray, reached: float
) -> tuple[FloatArray, FloatArray]:
    """Return each gain, and its standard deviation by its own peak: (S,), (S,).

    Parameters
    ----------
    peaks : (S,) float64
        Largest product of gain and weight in the take, for each shape.
    deviations : (S,) float64
        Their standard deviation.
    reached : float
        Probability that a movement went to its extreme.

    Notes
    -----
    The likelihood of a peak p with deviation s is ``reached * N(p; g, s^2 + (0.05 g)^2)`` plus
    ``(1 - reached) * P(g > p) / (p log 20)``; the prior N(1, d^2) on [0.5, 2]. Without extremes d
    is 0.2, and a peak well below 1 says nothing and leaves the prior as it is. With extremes the
    posterior is the mean of those by d = 0.02, 0.04, ... 0.2, weighted by the probability of all
    peaks together.
    """
    peak = np.maximum(peaks, _LEAST)[:, None]
    error = np.maximum(deviations, 1e-6)[:, None]
    width = np.hypot(error, _REACH * _GRID)
    extreme = np.exp(-0.5 * ((peak - _GRID) / width) ** 2) / (np.sqrt(2.0 * np.pi) * width)
    below = ndtr((_GRID - peak) / error) / (-peak * np.log(_LEAST))
    likelihood = reached * extreme + (1.0 - reached) * below
    spreads = PERFORMER_GAIN_SPREAD * np.linspace(1.0, _LEAST_SPREAD, 10 if reached else 1)
    priors = np.exp(-0.5 * ((_GRID - 1.0) / spreads[:, None]) ** 2)
    priors /= priors.sum(axis=1, keepdims=True)
    density = likelihood * priors[:, None]  # (D, S, G)
    total = density.sum(axis=2)
    # A peak beyond the whole range: all that is left is its end.
    beyond = (total == 0.0)[..., None]
    density = np.where(beyond, PERFORMER_GAIN_RANGE[1] <= _GRID, density)
    density /= density.sum(axis=2, keepdims=True)
    evidence = np.log(total, out=np.full(total.shape, -np.inf), where=total > 0.0)
    means = density @ _GRID
    own = density[0]
    deviations = np.sqrt(np.maximum(own @ _GRID**2 - means[0] ** 2, 0.0))
    # Cut off on one side, the prior has a mean that says more than the take does; its peak stays.
    if not reached:
        return _GRID[own.argmax(axis=1)], deviations
    seen = np.isfinite(evidence[0])
    gains = softmax(evidence[:, seen].sum(axis=1)) @ means
    # Their weights add up to 1 but for rounding.
    return gains.clip(*PERFORMER_GAIN_RANGE), deviations
