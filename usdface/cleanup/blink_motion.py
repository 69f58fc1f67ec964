"""The motion with which a tracker's landmarks answer blinks.

A tracker of landmarks fits a face model of a few shapes to the image, none of which closes the lids
alone (OpenFace: the modes of a point distribution model). In a blink its eye corners, brows,
contour and bridge of the nose move together, and the solve puffs the cheeks, raises the brows and
tilts the head for a frame or two. Where the recorder saw the blink itself, the landmarks tell
nothing more of it: the motion that all blinks have in common is to be taken off, and the closure
layer closes the lids by the recording.

In the frames around a blink, d(t) is the deviation of the landmarks from the line between the first
and the last of these frames, without the motion of the head: the similarity of the image from which
most landmarks differ least. With p(t) the height of the recorded pulse, the common motion is the
least-squares response ``u = sum p d / sum p^2`` over all blinks, of each landmark as far as the
blinks agree; a frame has it by ``a = d . u / |u|^2``, 0 at least.
"""

from dataclasses import replace

import numpy as np
from scipy.ndimage import grey_opening

from usdface.arrays import FloatArray, IntArray
from usdface.findings import Finding, finding
from usdface.numerics.frame_ranges import frame_ranges
from usdface.takes import MarkerTake, frame_step, visible

__all__ = ["LEAST_BLINK", "LONGEST_BLINK", "blink_motion", "without_blink_motion"]

# Longest blink [s], with a margin for the smoothing that recordings come with (0.5 s: Stern,
# Walrath, Goldstein, "The endogenous eyeblink", 1984).
LONGEST_BLINK = 0.6
# Least height of a recorded blink: half of the intensity A, the least of FACS, of which 5 steps
# make 1. The two blinks of a real take: 0.20 and 0.15.
LEAST_BLINK = 0.1
# A blink begins and ends at this share of the least height. Set by hand.
_BEGUN = 0.1
# Rounds of weighting landmarks by how far they move. Set by hand.
_ROUNDS = 10
# Landmarks that are off by less are still [px]: far above rounding, far below any noise.
_STILL = 1e-9
# Fewer landmarks move by a similarity of the image, which has four numbers; one blink does not tell
# the tracker's motion from the performer's.
_FEWEST, _FEWEST_BLINKS = 5, 2


def without_blink_motion(take: MarkerTake) -> tuple[MarkerTake, list[Finding]]:
    """Take the motion of blinks off the markers of an image, where a recorder saw them itself.

    Returns
    -------
    MarkerTake
        The same, if it is in space or no blink is recorded.
    list of Finding
        BLINK_MOTION_REMOVED if there is such motion.
    """
    if take.blink is None or take.dimension != 2:
        return take, []
    seen = np.flatnonzero(take.visible.any(axis=0))
    motion = blink_motion(take.positions[:, seen], take.times, take.blink)
    lengths = np.linalg.norm(motion, axis=2)
    if lengths.max(initial=0.0) <= _STILL:
        return take, []
    positions = take.positions.copy()
    positions[:, seen] -= motion
    frame, most = np.unravel_index(lengths.argmax(), lengths.shape)
    message = (
        "markers move with the eyes where the recorder saw a blink, {marker} by {length_px:.2g} px "
        "in frame {frame}; this motion is taken off"
    )
    found = finding(
        *("BLINK_MOTION_REMOVED", take.source, message),
        *(take.names[seen[most]], float(lengths.max()), int(frame)),
    )
    return replace(take, positions=positions), [found]


def blink_motion(positions: FloatArray, times: FloatArray, blink: FloatArray) -> FloatArray:
    """Return the motion of landmarks that recorded blinks have in common: (F, M, 2) [px].

    Parameters
    ----------
    positions : (F, M, 2) float64 [px]
        NaN where occluded; blinks in which one is occluded stay as they are, as does a single one.
    times : (F,) float64 [s]
    blink : (F,) float64
        `usdface.takes.MarkerTake.blink`; between frames without a face it is interpolated.
    """
    motion = np.zeros(positions.shape)
    pulses = _pulses(times, blink)
    seen = np.asarray(visible(positions).all(axis=1))
    around = [frames for frames in _around_blinks(pulses) if seen[frames].all()]
    if len(around) < _FEWEST_BLINKS or positions.shape[1] < _FEWEST:
        return motion
    head = _similarities(positions[seen].mean(axis=0))
    deviations = [_without_head(_from_line(positions[frames]), head) for frames in around]
    common = _common(deviations, [pulses[frames] for frames in around])
    size = max(float(common @ common), 1e-300)
    for frames, deviation in zip(around, deviations, strict=True):
        share = np.maximum(deviation @ common / size, 0.0)
        motion[frames] = (share[:, None] * common).reshape(len(frames), -1, 2)
    return motion


def _pulses(times: FloatArray, blink: FloatArray) -> FloatArray:
    """Return the pulses of a curve (F,), no longer than blinks: its white top-hat."""
    known = np.flatnonzero(np.isfinite(blink))
    if len(times) < 3 or not len(known):
        return np.zeros(len(times))
    curve = np.interp(times, times[known], blink[known])
    width = max(round(LONGEST_BLINK / frame_step(times)), 3)
    return np.asarray(curve - grey_opening(curve, width, mode="nearest"))


def _around_blinks(pulses: FloatArray) -> list[IntArray]:
    """Return the frames of each blink, from the last before it to the first after it."""
    return [
        np.arange(max(first - 1, 0), min(last + 2, len(pulses)))
        for first, last in frame_ranges(pulses > _BEGUN * LEAST_BLINK)
        if pulses[first : last + 1].max() >= LEAST_BLINK
    ]


def _from_line(positions: FloatArray) -> FloatArray:
    """Return the deviation from the line between the first and the last frame: (N, 2 M)."""
    share = np.linspace(0.0, 1.0, len(positions))[:, None, None]
    line = (1.0 - share) * positions[0] + share * positions[-1]
    return np.asarray((positions - line).reshape(len(positions), -1))


def _similarities(landmarks: FloatArray) -> FloatArray:
    """Return an orthonormal basis (2 M, 4) of small similarities of landmarks (M, 2)."""
    x, y = (landmarks - landmarks.mean(axis=0)).T
    one, zero = np.ones(len(x)), np.zeros(len(x))
    across = np.stack([[one, zero], [zero, one], [x, y], [-y, x]])
    return np.linalg.qr(across.transpose(2, 1, 0).reshape(-1, 4))[0]


def _without_head(motion: FloatArray, head: FloatArray) -> FloatArray:
    """Return motion (N, 2 M) less the similarity from which most landmarks differ least.

    By iteratively reweighted least squares with Cauchy weights, as wide as the median.
    """
    weights = np.ones((len(motion), len(head) // 2))
    rest = motion
    for _ in range(_ROUNDS):
        weighted = np.repeat(weights, 2, axis=1)[..., None] * head
        right = np.einsum("nik,ni->nk", weighted, motion)
        moved = np.linalg.solve(weighted.transpose(0, 2, 1) @ head, right[..., None])[..., 0]
        rest = motion - moved @ head.T
        apart = np.linalg.norm(rest.reshape(len(rest), -1, 2), axis=2)
        usual = np.maximum(np.median(apart, axis=1, keepdims=True), _STILL)
        weights = 1.0 / (1.0 + (apart / usual) ** 2)
    return np.asarray(rest)


def _common(deviations: list[FloatArray], pulses: list[FloatArray]) -> FloatArray:
    """Return the response of all landmarks to a pulse of height 1: (2 M,).

    Each landmark's is lowered by the share of its square that the scatter of the blinks explains.
    """
    own = np.array([p @ d for p, d in zip(pulses, deviations, strict=True)])
    power = np.array([p @ p for p in pulses])
    response = own.sum(axis=0) / power.sum()
    apart = (own - power[:, None] * response) / power.sum()
    error = (apart**2).sum(axis=0) * len(own) / (len(own) - 1)
    error, size = (each.reshape(-1, 2).sum(axis=1) for each in (error, response**2))
    agreed = np.clip(1.0 - error / np.maximum(size, 1e-300), 0.0, 1.0)
    return np.asarray(np.repeat(agreed, 2) * response)
