"""Tracks with occlusion, confidence and doubts of each sample."""

from collections.abc import Sequence

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.cleanup.low_rank_model import (
    FRAMES_PER_MODE,
    fit_low_rank_model,
    predict_from_others,
)
from usdface.footage.dots import Dots
from usdface.footage.follow import nearest_distances
from usdface.footage.still_places import median_visible, still_places
from usdface.footage.tracks import Doubt, Tracks
from usdface.numerics.robust_deviation import MEDIAN_TO_DEVIATION, THIRD_DIFFERENCE

__all__ = ["finished_tracks"]

# Distance from the place predicted by the other tracks at which a track is doubted, as a share of
# the distance to the nearest neighbour.
_DOUBT = 0.45
# A dot is occluded below this share of its usual area at that time, or above the second one if it
# fills less of its ellipse than one dot does (two discs side by side fill 0.89, a dot that the skin
# stretches 0.99); its confidence falls from 1 at `_FULL` on. Frames about it.
_PART, _MERGED, _FULL, _ONE = 0.35, 1.9, 0.8, 0.93
_ABOUT, _NEIGHBOURS = 8, 4
# Distance from the place predicted by the others [shares of the spacing] and deviation [px] at
# which confidence is 0.6; frames that disagree between both directions have this confidence.
_STRAY, _VAGUE, _DISAGREED = 0.3, 0.35, 0.3
# Least number of third differences for a track's jitter; factor from their median absolute value to
# the deviation of places.
_ENOUGH, _JITTER = 24, MEDIAN_TO_DEVIATION / np.sqrt(THIRD_DIFFERENCE)


def finished_tracks(
    frames: Sequence[Dots],
    table: IntArray,
    agreed: BoolArray,
    at: int,
    cuts: tuple[int, ...],
    left_out: int,
) -> Tracks:
    """Return the tracks of a table of dots, numbered.

    Parameters
    ----------
    frames : sequence of Dots, length F
    table : (F, M) int64
        The dot of each track in each frame, or HIDDEN.
    agreed : (F, M) bool
        Where both directions of time give the same dot.
    at : int
        The reference frame.
    cuts, left_out
        As of `Tracks`.
    """
    shape = table.shape
    seen = table >= 0
    places, ellipses = np.full((*shape, 2), np.nan), np.full((*shape, 3), np.nan)
    deviations, areas, fills = (np.full(shape, np.nan) for _ in range(3))
    for number, (dots, row) in enumerate(zip(frames, table, strict=True)):
        mine, own = seen[number], row[seen[number]]
        places[number, mine] = dots.centres[own]
        ellipses[number, mine] = np.column_stack([dots.axes[own], dots.angles[own]])
        deviations[number, mine] = dots.deviations[own]
        areas[number, mine], fills[number, mine] = dots.areas[own], dots.fills[own]
    # Dots that merge for long are usual at that time, but not in the film.
    together = (_film_share(areas, places) > _MERGED) & (fills < _ONE)
    share = _whole_share(np.where(together, np.nan, areas), places)
    merged = together | ((share > _MERGED) & (fills < _ONE))
    occluded = seen & ((share < _PART) | merged)
    for values in (places, ellipses):
        values[occluded] = np.nan
    deviations[occluded] = np.nan
    seen &= ~occluded
    deviations = _with_jitter(deviations, places)
    stray = _stray(places, seen)
    confidence = np.where(share < 1, ((share - _PART) / (_FULL - _PART)).clip(0.1, 1.0), 1.0)
    confidence *= np.exp(-0.5 * (np.nan_to_num(stray) / _STRAY) ** 2)
    confidence *= np.exp(-0.5 * (np.nan_to_num(deviations) / _VAGUE) ** 2)
    confidence = np.where(agreed, confidence, np.minimum(confidence, _DISAGREED))
    confidence = np.where(seen, confidence, 0.0)
    doubts = _doubts(seen & (~agreed | (stray > _DOUBT)))
    names = tuple(f"dot_{k + 1:02d}" for k in range(shape[1]))
    return Tracks(names, places, deviations, ellipses, confidence, at, cuts, doubts, left_out)


def _whole_share(areas: FloatArray, places: FloatArray) -> FloatArray:
    """Return each area (F, M) over the dot's usual one at that time, 1 where it is occluded.

    Divided by that of its neighbours: a face that turns away shows all of them smaller.
    """
    share = np.ones_like(areas)
    # 70th percentile of blocks: a dot that is half occluded for long is not usual.
    count = max(1, round(len(areas) / (2 * _ABOUT)))
    blocks = np.array_split(np.arange(len(areas)), count)
    for number, block in enumerate(blocks):
        near = np.concatenate(blocks[max(0, number - 1) : number + 2])
        have = ~np.isnan(areas[near]).all(axis=0)
        usual = np.ones(areas.shape[1])
        usual[have] = np.nanpercentile(areas[near][:, have], 70, axis=0)
        share[block] = areas[block] / usual
    share /= np.minimum(_around(share, places), 1.0)
    return np.nan_to_num(share, nan=1.0)


def _film_share(areas: FloatArray, places: FloatArray) -> FloatArray:
    """Return each area (F, M) over the dot's median one, as its neighbours' is."""
    have = ~np.isnan(areas).all(axis=0)
    share = np.ones_like(areas)
    share[:, have] = areas[:, have] / np.nanmedian(areas[:, have], axis=0)
    return np.nan_to_num(share / _around(share, places), nan=1.0)


def _around(share: FloatArray, places: FloatArray) -> FloatArray:
    """Return the median share (F, M) of each dot's neighbours; 1 where there are none."""
    if share.shape[1] <= _NEIGHBOURS:
        return np.ones_like(share)
    home = np.nan_to_num(median_visible(places), nan=1e6)
    order = np.argsort(np.linalg.norm(home[:, None] - home, axis=2), axis=1)
    around = np.nan_to_num(share, nan=1.0)[:, order[:, 1 : _NEIGHBOURS + 1]]
    return np.asarray(np.median(around, axis=2).clip(min=1e-3))


def _with_jitter(deviations: FloatArray, places: FloatArray) -> FloatArray:
    """Return deviations (F, M) that are at least as large as the jitter of each track (F, M, 2).

    The noise around a dot does not include errors by compression blocks, by whole pixels and by
    chroma at half resolution; the jitter of the track does. Third differences remove the motion of
    the face.
    """
    if len(places) < _ENOUGH:
        return deviations
    third = np.abs(np.diff(still_places(places), 3, axis=0))
    raised = deviations.copy()
    for track in np.flatnonzero((~np.isnan(third)).sum(axis=(0, 2)) >= _ENOUGH).tolist():
        jitter = _JITTER * float(np.nanmedian(third[:, track]))
        stated = float(np.nanmedian(deviations[:, track]))
        raised[:, track] = np.hypot(deviations[:, track], max(jitter**2 - stated**2, 0.0) ** 0.5)
    return raised


def _stray(places: FloatArray, seen: BoolArray) -> FloatArray:
    """Return each dot's distance (F, M) from its predicted place, in spacings; 0 = unknown."""
    if len(places) < 3 * FRAMES_PER_MODE or places.shape[1] < 6:
        return np.zeros(seen.shape)
    still = still_places(places)
    home = median_visible(still)
    filled = np.where(np.isnan(still), home, still)
    model, _ = fit_low_rank_model(still, seen, filled)
    predicted = predict_from_others(model, np.nan_to_num(still), seen)
    away = np.linalg.norm(predicted - still, axis=2)
    return np.asarray(np.nan_to_num(away / nearest_distances(home)))


def _doubts(wrong: BoolArray) -> tuple[Doubt, ...]:
    """Return the stretches of each track (F, M) that are doubted."""
    found = []
    for track in np.flatnonzero(wrong.any(axis=0)).tolist():
        frames = np.flatnonzero(wrong[:, track])
        breaks = np.flatnonzero(np.diff(frames) > 2) + 1
        found += [Doubt(track, int(p[0]), int(p[-1])) for p in np.split(frames, breaks)]
    return tuple(found)
