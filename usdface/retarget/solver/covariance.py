"""Covariance of the weights over a take, learned from the take itself.

The weights are taken for one random process: their covariance in a frame is M, (S, S), and each
of them is white noise through a second-order low-pass (Butterworth) of corner w0, so that its
spectrum falls off as 1 / (w^4 + w0^4); the noise of the markers is white. M is the most likely
one, found by expectation maximisation (Dempster, Laird and Rubin 1977; empirical Bayes).
Frequencies are independent there, and those with similar spectra are binned, so that the cost of a
step does not grow with the take. The bounds of the weights are ignored; they only enter by the
start.
"""

from itertools import pairwise

import numpy as np
from scipy.fft import dct
from scipy.linalg import eigh

from usdface.arrays import FloatArray
from usdface.retarget.solver.curvature import curvature_bands
from usdface.takes import frame_step

__all__ = ["inverse_bands", "inverse_spectrum", "learn_covariance"]

# Steps of expectation maximisation, and bins of frequency. Set by hand; docs/constants.md.
_STEPS = 20
_BINS = 16
# Prior variance of a weight, and the number of frames that it counts as. The start has at least
# this share of it in every direction, else it would never leave 0. Chosen on the first 2,015
# recorded frames; the benchmark of the solve scores the others.
_EXPECTED = 0.005
_BELIEF = 5.0
_LEAST = 0.02
# Least eigenvalue, of the largest: smaller ones are rounding of sums over frames. Set by hand.
_SHOWN = 1e-6


def inverse_spectrum(frequencies: FloatArray, step: float, pace: float) -> FloatArray:
    """Return the inverse of the process's spectrum, for variance 1 in a frame.

    Parameters
    ----------
    frequencies : (N,) float64 [rad]
        Per frame, 0 to pi.
    step : float [s]
        Between frames.
    pace : float [rad/s]
        The corner w0.
    """
    curvature = (2.0 - 2.0 * np.cos(frequencies)) ** 2 / step**3
    return np.asarray((curvature + pace**4 * step) / _power(pace))


def inverse_bands(times: FloatArray, pace: float) -> FloatArray:
    """Return the inverse covariance over time of the process, for variance 1: (3, F).

    Upper banded storage, as `usdface.retarget.solver.curvature.curvature_bands`.
    """
    bands = curvature_bands(times)
    bands[2] += pace**4 * frame_step(times)
    return bands / _power(pace)


def _power(pace: float) -> float:
    """Return the power of the white noise that makes the variance in a frame 1 [1/s^3]."""
    return float(2.0 * np.sqrt(2.0) * pace**3)


def learn_covariance(
    normal: FloatArray,
    right: FloatArray,
    times: FloatArray,
    variance: float,
    pace: float,
    weights: FloatArray,
) -> FloatArray:
    """Return the most likely covariance of the weights: (S, S), symmetric positive definite.

    Parameters
    ----------
    normal : (S, S) float64 [m^2]
        D'D of the marker offsets D, plus the ridge that is not learned.
    right : (F, S) float64 [m^2]
        D'y of every frame.
    times : (F,) float64 [s]
        At least three; taken as evenly spaced.
    variance : float [m^2]
        Of the noise of a marker coordinate, above 0.
    pace : float [rad/s]
        The corner w0.
    weights : (F, S) float64
        A solution within bounds, where the search starts.
    """
    count = len(times)
    edges = np.unique(np.round(np.geomspace(1, count, _BINS)).astype(int))
    edges = np.concatenate([[0], edges])
    step = frame_step(times)
    spectrum = inverse_spectrum(np.pi * np.arange(count) / count, step, pace)
    waves = dct(right, norm="ortho", axis=0)
    power = np.stack([waves[a:b].T @ waves[a:b] for a, b in pairwise(edges)])
    held = np.diff(edges)
    inverse = np.add.reduceat(spectrum, edges[:-1]) / held
    ridge = variance * inverse
    expected = _EXPECTED * np.eye(len(normal))
    covariance = weights.T @ weights / count + _LEAST * expected
    for _ in range(_STEPS):
        half = np.linalg.cholesky(covariance)
        values, turned = eigh(half.T @ normal @ half)
        # Ascending. Directions below rounding, most of a large rig's, see no marker.
        first = int(np.searchsorted(values, _SHOWN * values[-1], side="right"))
        values[:first] = 0.0
        vectors = half @ turned
        passed = 1.0 / (values + ridge[:, None])
        shown, gains = vectors[:, first:], passed[:, first:]
        seen = shown.T @ power @ shown
        seen *= (gains * inverse[:, None])[:, :, None] * gains[:, None, :]
        spread = np.diag((held * ridge) @ passed)
        spread[first:, first:] += seen.sum(axis=0)
        moved = vectors @ spread @ vectors.T
        covariance = (moved + _BELIEF * expected) / (count + _BELIEF)
        covariance = 0.5 * (covariance + covariance.T)
    return np.asarray(covariance)
