"""How far the performer's lips are open, measured by pairs of markers.

Markers above and below the mouth that are opposite each other make a pair; lips touch where a pair
is as near as in the neutral frames, or nearer: after contact lips go on moving towards each other,
to a negative aperture (A. Lofqvist, V. Gracco, "Labial kinematics in stop consonant production",
Journal of the Acoustical Society of America 99, 1996).
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d

from usdface.arrays import FloatArray, IntArray
from usdface.closure.even_times import even_times
from usdface.face.bound_face import BoundFace
from usdface.numerics.frame_blocks import by_blocks
from usdface.retarget.solution import Solution
from usdface.takes import WeightsTake

__all__ = ["LipDistances", "lip_distances", "lip_pairs"]

# In widths of the line on which the lips touch: how far from it a marker of a lip may be (20 mm of
# 43 on ICT, where one is 17 mm below), and how far beside each other two of a pair.
_NEAR, _BESIDE = 0.45, 0.2
# Standard deviation [s] of the smoothing: short against a closure of the lips.
_SMOOTHING = 0.03
# A pair is used if its distance over the take correlates so well with that of the character as
# solved, with at least this slope. Others are not opposite each other, or bound to the wrong lip.
_ALIKE, _AS_FAR = 0.7, 0.5


class LipDistances(NamedTuple):
    """How much further apart points of the two lips are than at rest: (F, K) each [m].

    Of the markers (`seen`), and of the same points on the character as solved (`shown`); and the
    standard deviation of `seen` by the noise of the markers [m].
    """

    seen: FloatArray
    shown: FloatArray
    noise: float


def lip_pairs(face: BoundFace, markers: Sequence[str]) -> IntArray:
    """Return the pairs of markers, of the upper and of the lower lip, opposite each other: (P, 2).

    Places among `markers`, from the nearest pair to the farthest; a marker may be in several.
    """
    none = np.zeros((0, 2), dtype=np.int64)
    if not len(face.layout.lips) or not len(markers):
        return none
    line = face.mesh.points[face.layout.lips].mean(axis=1)
    right, width = _mouth(face)
    places = face.mesh.points[face.vertices_of(markers)]
    apart = places[:, None] - line[None]
    distance = np.linalg.norm(apart, axis=2)
    above = apart[np.arange(len(places)), distance.argmin(axis=1), 1]
    inner = (places[:, 0] > right) & (places[:, 0] < right + width)
    near = inner & (distance.min(axis=1) < _NEAR * width)
    upper, lower = np.flatnonzero(near & (above > 0)), np.flatnonzero(near & (above < 0))
    beside = np.abs(places[upper, None, 0] - places[lower, 0])
    first, second = np.nonzero(beside < _BESIDE * width)
    pairs = np.stack([upper[first], lower[second]], axis=1)
    away = np.linalg.norm(places[pairs[:, 0]] - places[pairs[:, 1]], axis=1)
    return pairs[np.argsort(away, kind="stable")]


def lip_distances(
    face: BoundFace, solved: WeightsTake, solution: Solution, across: FloatArray, x: FloatArray
) -> LipDistances | None:
    """Return the distances between the lips, of the markers and of the character as solved.

    Parameters
    ----------
    face : BoundFace
    solved : WeightsTake
    solution : Solution
    across : (3,) float64
        Unit vector from the lower to the upper lip.
    x : (K,) float64 [m]
        The places along the lips, rising.

    Returns
    -------
    LipDistances or None
        None where no pair of markers opens and closes with the mouth.
    """
    pairs = lip_pairs(face, solution.markers)
    if not len(pairs):
        return None
    vertices = face.vertices_of(solution.markers)
    rest = face.mesh.points[vertices]
    order = [face.markers.index(name) for name in solution.markers]
    weights = [take.reordered(face.shape_names).weights for take in (solved, solution.weights)]

    def apart(frames: slice) -> FloatArray:
        posed, as_solved = (face.displacements(each[frames])[:, order] for each in weights)
        # On the character's own lips: the residual of the solve is the same on both faces.
        performed = as_solved + solution.leftover(frames)
        both = [m[:, pairs[:, 0]] - m[:, pairs[:, 1]] for m in (performed, posed)]
        return np.stack([moved @ across for moved in both], axis=1)

    distances = by_blocks(len(solved.times), apart)
    measured, posed = (_smooth(distances[:, of], solved.times) for of in (0, 1))
    least = face.tolerance
    agree = np.flatnonzero([_agree(a, b, least) for a, b in zip(measured.T, posed.T, strict=True)])
    used = agree[_one_at_a_place(pairs[agree], rest[:, 0], _BESIDE * _mouth(face)[1] / 2)]
    if not len(used):
        return None
    at = rest[pairs[used], 0].mean(axis=1)
    shares = np.stack([np.interp(x, at, row) for row in np.eye(len(at))])
    noise = np.sqrt(2.0) * solution.noise * _damped(solved.times)
    return LipDistances(measured[:, used] @ shares, posed[:, used] @ shares, float(noise))


def _mouth(face: BoundFace) -> tuple[float, float]:
    """Return x of the right corner of the mouth, and its width [m]."""
    x = face.mesh.points[face.layout.lips].mean(axis=1)[:, 0]
    return float(x.min()), float(np.ptp(x))


def _one_at_a_place(pairs: IntArray, x: FloatArray, apart: float) -> IntArray:
    """Return which pairs (P, 2) of markers at `x` are the nearest in their place, by rising x.

    `pairs` are from the nearest to the farthest, each place `apart` from the others [m].
    """
    kept: list[int] = []
    middles = x[pairs].mean(axis=1)
    for number, pair in enumerate(pairs.tolist()):
        if all(pair[0] != pairs[k, 0] and abs(middles[number] - middles[k]) > apart for k in kept):
            kept.append(number)
    return np.array(sorted(kept, key=lambda k: float(middles[k])), dtype=np.int64)


def _smooth(values: FloatArray, times: FloatArray) -> FloatArray:
    if len(times) < 3:
        return values
    even = even_times(times)
    sigma = _SMOOTHING / even.step
    smooth = gaussian_filter1d(even.resampled(values), sigma, axis=0, mode="nearest")
    return even.of_frames(np.asarray(smooth))


def _damped(times: FloatArray) -> float:
    """Return the share of white noise that the smoothing leaves."""
    if len(times) < 3:
        return 1.0
    sigma = _SMOOTHING / even_times(times).step
    return float(1.0 / max(np.sqrt(2.0 * np.sqrt(np.pi) * sigma), 1.0))


def _agree(measured: FloatArray, posed: FloatArray, least: float) -> bool:
    """Whether the markers of a pair part where the character's lips do, about as far.

    False where the character's part by no more than `least` [m].
    """
    if np.ptp(posed) <= least:
        return False
    measured, posed = measured - measured.mean(), posed - posed.mean()
    together = float(measured @ posed)
    sizes = float(measured @ measured), float(posed @ posed)
    return bool(together > _ALIKE * np.sqrt(sizes[0] * sizes[1]) and together > _AS_FAR * sizes[1])
