"""Pieces of one solve over time, side by side on all cores, and overlaps that hide the cuts.

They are in memory, unlike those of `usdface.shot.retarget_pieces`, which hold a take too long for
it. Each overlaps its neighbours so far that its ends have no effect after the given iterations of
ADMM.
"""

from itertools import pairwise
from math import ceil, cosh, log

import numpy as np
from scipy.linalg import cholesky_banded

from usdface.arrays import FloatArray

__all__ = ["overlap", "pieces"]

# Least length of a piece, in frames (1 MB of 53 weights) and in overlaps: at most a quarter more
# work.
_PIECE = 2048
_OVERLAPS = 8
# Allowed error of a weight by the end of a piece: about the single precision that is written.
_SEAM = 1e-7


def pieces(
    frames: int,
    normal: FloatArray,
    penalties: FloatArray,
    half: FloatArray,
    bands: FloatArray,
    iterations: int,
) -> list[tuple[slice, slice]]:
    """Return the frames of each piece, alone and with its overlaps.

    Parameters
    ----------
    frames : int
    normal : (S, S) float64
        N, positive definite.
    penalties : (S,) float64
        Of ADMM, the diagonal of P.
    half : (S, S) float64
        L of the weights' covariance M = L L'.
    bands : (3, F) float64
        K, upper banded storage.
    iterations : int
        Largest number of them.
    """
    if frames <= _PIECE:
        return [(slice(0, frames), slice(0, frames))]
    reach = overlap(normal, penalties, half, bands, iterations)
    count = ceil(frames / max(_PIECE, _OVERLAPS * reach))
    ends = [frames * i // count for i in range(count + 1)]
    return [
        (slice(first, last), slice(max(0, first - reach), min(frames, last + reach)))
        for first, last in pairwise(ends)
    ]


def overlap(
    normal: FloatArray,
    penalties: FloatArray,
    half: FloatArray,
    bands: FloatArray,
    iterations: int,
    seam: float = _SEAM,
) -> int:
    """Return after how many frames the end of a piece has no effect.

    Parameters are those of `pieces`; `seam` is the error of a weight that is negligible.

    In the unknowns L^-1 w weigh frame t by exp(c t), as Combes and Thomas (1973) do. If the
    symmetric part of the curvature so weighed, ``K_ts cosh(c (t - s))``, is above ``-(a + d)``,
    with a the least eigenvalue of L'NL and d the n-th part of twice the least one p of L'PL, P
    the penalties, then each of n iterations adds the error of a piece's end, less than
    ``1e3`` times the curvature's diagonal over p, and multiplies the error so far by less than
    ``1 + 4 / n`` (clipping never makes two iterates differ by more in the metric P). So the error
    z frames away is below that times ``n exp(4 - c z)``.
    """
    least = [half.T @ matrix for matrix in (normal @ half, penalties[:, None] * half)]
    seen, held = (max(0.0, float(np.linalg.eigvalsh(matrix)[0])) for matrix in least)
    slack = seen + 2.0 / iterations * held
    wrong = 1e3 * max(10.0, float(bands[2].max()) / max(held, 1e-300))
    decay, too_much = 1e-3, 2.0
    while too_much > 1.05 * decay:
        middle = float(np.sqrt(decay * too_much))
        weighed = bands * np.array([cosh(2.0 * middle), cosh(middle), 1.0])[:, None]
        weighed[2] += slack
        try:
            cholesky_banded(weighed, overwrite_ab=True, check_finite=False)
            decay = middle
        except np.linalg.LinAlgError:
            too_much = middle
    return ceil((log(wrong * iterations / seam) + 4.0) / decay)
