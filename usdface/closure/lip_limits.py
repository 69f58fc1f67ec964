"""How far the character's lips may be open, by the markers of the performer's."""

import numpy as np
from scipy.ndimage import gaussian_filter1d

from usdface.arrays import BoolArray, FloatArray
from usdface.closure.even_times import even_times
from usdface.closure.lip_signal import LipDistances
from usdface.numerics.frame_ranges import frame_ranges
from usdface.numerics.ramps import smooth_step

__all__ = ["WIDENS", "largest_apertures"]

# The solve is contradicted where markers of the two lips are nearer to each other by this many
# tolerances, or deviations of the noise; wholly at a tolerance more. The real take that leaves the
# mouth open: 1.4 to 4.6 tolerances.
_CONTRADICTED, _ABOVE_NOISE = 0.8, 3.0
# Misfit of the rig, in tolerances: up to the first the lips are trusted as solved, from the second
# on they are limited whatever the solve shows. Takes of another person on his own face 0.02 to
# 0.33, where the lips are solved to 0.3 mm; two real takes and two labelled ones on three other
# heads 1.3 to 3.9, where lips as near as at rest were solved open by up to 9 mm.
_LIKE, _UNLIKE = 0.5, 1.0
# Opening of the markers, in tolerances beyond the first, at which the limit of the lips rises twice
# as fast as it, and of which half stays open where another place is closed.
WIDENS = 2.0
# Standard deviation [s] of the smoothing with which a limit comes and goes.
_EASE = 0.05


def largest_apertures(
    distances: LipDistances,
    opened: FloatArray,
    tolerance: float,
    times: FloatArray,
    *,
    misfit: float,
) -> FloatArray:
    """Return how far the character's lips may be open: (F, K) [m], infinite = no limit.

    Markers lie beside the lips, and may be as near as at rest while these are open. A solve that
    explains the markers tells such lips; they are limited only where the markers contradict it:
    nearer to each other than the same points on the character. The limit then holds from where the
    character's lips part to where they meet again, or they would pop open. On another person's face
    the solve rolls lips open to follow markers that touch, so there the limit holds in all frames.

    Parameters
    ----------
    distances : LipDistances
    opened : (F, K) float64 [m]
        By how much the character's lips are open as solved.
    tolerance : float [m]
        Of a contact.
    times : (F,) float64 [s]
    misfit : float [m]
        `usdface.retarget.solution.Solution.misfit`: how unlike the rig the performer's face is.
    """
    beyond = np.maximum(distances.seen - tolerance, 0.0)
    limit = tolerance + beyond + beyond**2 / (2.0 * WIDENS * tolerance)
    low = max(_CONTRADICTED * tolerance, _ABOVE_NOISE * distances.noise)
    sure = smooth_step((distances.shown - distances.seen - low) / tolerance)
    unlike = smooth_step(np.asarray((misfit / tolerance - _LIKE) / (_UNLIKE - _LIKE)))
    sure = np.maximum(_throughout(sure, opened > limit, times), unlike)
    return np.asarray(np.divide(limit, sure, out=np.full(sure.shape, np.inf), where=sure > 0))


def _throughout(sure: FloatArray, apart: BoolArray, times: FloatArray) -> FloatArray:
    """Return a share (F, K), at its largest throughout each stretch in which the lips are apart."""
    result = sure.copy()
    for place in range(sure.shape[1]):
        for first, last in frame_ranges(apart[:, place]):
            result[first : last + 1, place] = sure[first : last + 1, place].max()
    if len(times) < 3:
        return result
    # Just beyond a stretch the correction can part lips that were solved within the limit.
    even = even_times(times)
    eased = gaussian_filter1d(even.resampled(result), _EASE / even.step, axis=0, mode="nearest")
    return np.asarray(np.maximum(result, even.of_frames(np.asarray(eased))))
