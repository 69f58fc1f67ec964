"""Noise of the markers, and misfit between face and rig."""

import numpy as np
from scipy.special import chdtri

from usdface.arrays import BoolArray, FloatArray

__all__ = ["MOST", "marker_misfit", "marker_noise", "unexplained"]

# Misfit grows with the expression and is nothing at rest. This share of the frames has less:
# neither a resting face nor a few swapped markers decide.
MOST = 0.9


def unexplained(explained: FloatArray) -> FloatArray:
    """Return an orthonormal basis of the complement of the span of `explained` (K, N): (N, R)."""
    basis, values, _ = np.linalg.svd(explained.T, full_matrices=True)
    rank = int((values > 1e-9 * values.max(initial=0.0)).sum())
    return np.asarray(basis[:, rank:])


def marker_noise(rest: FloatArray, seen: BoolArray) -> float:
    """Estimate the white noise of marker coordinates, from their part that nothing explains.

    That is the part beyond all weights and poses.

    Third differences in time keep the noise (their variance is 20 times the noise's) and
    drop the slow misfit of rig and performer. The median makes it robust to spikes.

    Parameters
    ----------
    rest : (F, R) float64 [m]
        Marker displacements, gaps filled, in the basis that `unexplained` returns.
    seen : (F,) bool
        Frames in which every marker was seen; others are left out where enough remain.

    Returns
    -------
    float [m]
        Standard deviation; 0 if there are too few frames or markers to tell.
    """
    if rest.shape[1] == 0 or len(rest) < 4:
        return 0.0
    differences = np.diff(rest, 3, axis=0) / np.sqrt(20.0)
    whole = np.lib.stride_tricks.sliding_window_view(seen, 4).all(axis=1)
    if whole.sum() >= 16:
        differences = differences[whole]
    return float(np.median(np.abs(differences)) * 1.4826)


def marker_misfit(rest: FloatArray, seen: BoolArray, noise: float) -> float:
    """Estimate by how much face and rig differ, from the part that no weight and no pose explains.

    Parameters are those of `marker_noise`, and its result `noise` [m].

    Returns
    -------
    float [m]
        RMS over the coordinates of an expressive frame; 0 where noise explains it all.
    """
    count = rest.shape[1]
    if count == 0:
        return 0.0
    rest = rest[seen] if seen.sum() >= 16 else rest
    most = float(np.quantile((rest**2).mean(axis=1), MOST))
    of_noise = noise**2 * float(chdtri(count, 1.0 - MOST)) / count
    return float(np.sqrt(max(0.0, most - of_noise)))
