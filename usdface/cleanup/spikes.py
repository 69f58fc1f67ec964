"""Spikes: a marker that jumps away from its prediction by the others, and jumps back."""

import numpy as np
from scipy.ndimage import median_filter

from usdface.arrays import BoolArray, FloatArray

__all__ = ["find_spikes", "find_strays"]

# A jump is larger than this many times the median step, and than a face moves in a frame: a share
# of its size (as `face_unit`, some 60 mm) and a share per second. Real optical takes at 60 Hz
# stay below 0.023, real weight curves at 30 Hz on a rig below 0.05.
_USUAL = 6.0
_SHARE = 0.02
_SPEED = 1.5
# Errors longer than this window [s] are motion of the face that the model does not have.
_WINDOW = 0.5
# A piece of a marker's path is a spike if it is this many jumps off its surroundings, or its take;
# set by hand; judge: `python benchmarks/cleanup.py`, docs/constants.md lists them.
_OFF = 0.6
_FAR = 4.0
# A marker is astray if it is farther from the middle of the face than it is usually, by this many
# times the usual distance of all: some 13 cm, where a jaw opens by 5. Set by hand.
_ASTRAY = 2.0
_FEWEST_MARKERS = 6  # show where the middle of the face is


def find_spikes(
    positions: FloatArray, predicted: FloatArray, visible: BoolArray, *, size: float, rate: float
) -> BoolArray:
    """Find the entries that are off by a jump.

    Parameters
    ----------
    positions : (F, M, 3) float64 [m]
        Markers without head motion.
    predicted : (F, M, 3) float64 [m]
        Each marker as the others predict it.
    visible : (F, M) bool
    size : float [m]
        RMS distance of the face's markers from their centroid.
    rate : float [Hz]

    Returns
    -------
    (F, M) bool
    """
    found = np.zeros(visible.shape, dtype=bool)
    both = visible[1:] & visible[:-1]
    error = positions - predicted
    # The error alone also jumps where another marker is taken out of the prediction.
    jumps = np.minimum(_steps(error), _steps(positions))
    window = 2 * round(_WINDOW * rate / 2) + 1
    for m in np.flatnonzero(both.sum(axis=0) >= 3):
        usual = float(np.median(jumps[both[:, m], m]))
        limit = max(_USUAL * usual, (_SHARE + _SPEED / rate) * size)
        cut = both[:, m] & (jumps[:, m] > limit)
        if not cut.any():
            continue
        frames = np.flatnonzero(visible[:, m])
        mine = error[frames, m]
        # Beyond the ends are copies of the end, of which a longer window would be full.
        width = min(window, len(mine) - 1 + len(mine) % 2)
        slow = np.stack([median_filter(c, width, mode="nearest") for c in mine.T], axis=1)
        off = np.linalg.norm(mine - slow, axis=1) > _OFF * limit
        away = np.linalg.norm(mine - np.median(mine, axis=0), axis=1)
        off |= away > _FAR * max(limit, float(np.median(away)))
        # Pieces of the path between jumps and gaps; one that a jump bounds can be a spike.
        breaks = cut[frames[1:] - 1] | (np.diff(frames) > 1)
        piece = np.concatenate([[0], np.cumsum(breaks)])
        bounded = np.zeros(piece[-1] + 2, dtype=bool)
        ends = piece[1:][cut[frames[1:] - 1] & (np.diff(frames) == 1)]
        bounded[ends] = bounded[ends - 1] = True
        share = np.bincount(piece, off) / np.bincount(piece)
        spikes = (bounded[:-1] & (share > 0.5))[piece]
        if spikes.mean() <= 0.5:  # where a marker is most of the time is its place
            found[frames, m] = spikes
    return found


def find_strays(positions: FloatArray, visible: BoolArray) -> BoolArray:
    """Find the entries (F, M) that are nowhere near the face.

    Such as the 0, 0, 0 or 9999999 that some programs write for a marker that they lost. They need
    no model of the face, which they would spoil, and no pose of the head: turns and moves of the
    head change no distance from its middle.

    Parameters
    ----------
    positions : (F, M, 3) float64 [m]
        NaN where occluded.
    visible : (F, M) bool
    """
    found = np.zeros(visible.shape, dtype=bool)
    frames = np.flatnonzero(visible.sum(axis=1) >= _FEWEST_MARKERS)
    ever = np.flatnonzero(visible[frames].any(axis=0))
    if not len(frames):
        return found
    places = np.where(visible[..., None], positions, np.nan)[np.ix_(frames, ever)]
    away = np.linalg.norm(places - np.nanmedian(places, axis=1, keepdims=True), axis=2)
    usual = np.nanmedian(away, axis=0)
    found[np.ix_(frames, ever)] = away > usual + _ASTRAY * np.median(usual)
    return found


def _steps(path: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(np.diff(path, axis=0), axis=2))
