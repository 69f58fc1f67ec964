"""Clean-up of a take: blinks, swaps, spikes, gaps, because each step needs the one before."""

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.cleanup.blink_motion import without_blink_motion
from usdface.cleanup.gaps import OWN, fill_gaps
from usdface.cleanup.label_assignment import assign_labels, cycles, last_visible
from usdface.cleanup.low_rank_model import (
    FRAMES_PER_MODE,
    fit_low_rank_model,
    predict_from_others,
    reconstruct,
)
from usdface.cleanup.repairs import Kind, Repair, repair_findings
from usdface.cleanup.spikes import find_spikes, find_strays
from usdface.cleanup.stabilise import ROUNDS, StabilisedMarkers, stabilise
from usdface.findings import Finding, finding
from usdface.geometry.marker_spread import rms_radius
from usdface.geometry.nearest_points import nearest_points
from usdface.geometry.rigid_fit import Pose, rigid_fit
from usdface.numerics.frame_ranges import frame_ranges
from usdface.options import CleanOptions
from usdface.retarget.neutral import on_plane
from usdface.retarget.solver.noise import white_noise
from usdface.takes import MarkerTake, frame_step

__all__ = ["Cleaned", "clean_take"]

# Fewer markers do not predict one another, or the head pose; fewer frames show no two modes.
_FEWEST_MARKERS = 6
_FEWEST_FRAMES = 2 * FRAMES_PER_MODE
# Rounds in which spikes are searched, unless they stay the same before.
_ROUNDS = 4
# Rounds of pose and model from a pose that is known already. This and the next: set by hand; judge:
# `python benchmarks/cleanup.py`; docs/constants.md lists them.
_REFINED = 2
# Rounds of the model before long gaps are filled: expectation and maximisation converges slowly
# where much is occluded (Tipping and Bishop 1999).
_LONG = 20
# Gaps [s] that a marker's own motion bridges where the other markers are occluded as well: from
# both ends for the time in which it predicts better than they do (`gaps.OWN`).
_SHORT = 2.0 * OWN
# Larger coordinates are invalid, and their squares would overflow.
_LARGEST = 1e60


@dataclass(frozen=True, eq=False, slots=True)
class Cleaned:
    """A cleaned take.

    Attributes
    ----------
    take : MarkerTake
        Labels corrected, spikes and gaps filled in where other markers or both ends predict them.
    measured : (F, M) bool
        True where the position was recorded, not filled in.
    repairs : tuple of Repair
        By kind, marker and frame.
    """

    take: MarkerTake
    measured: BoolArray
    repairs: tuple[Repair, ...]


def clean_take(
    take: MarkerTake,
    markers: Collection[str],
    options: CleanOptions,
    *,
    moving: bool = True,
    neutral: tuple[int, int] | None = None,
) -> tuple[Cleaned, list[Finding]]:
    """Take off the motion of blinks, repair swaps, take out spikes and fill gaps.

    Parameters
    ----------
    take : MarkerTake
    markers : collection of str
        Labels of the face and head, in any order; others are left alone, and names that the
        take does not have are ignored.
    options : CleanOptions
    moving : bool
        False if the head motion has been removed from the take.
    neutral : (int, int), optional
        First and last neutral frame, inclusive, whose labels are right; those of most frames are,
        if left out.

    Returns
    -------
    Cleaned
    list of Finding
        BLINK_MOTION_REMOVED; MARKER_SWAPPED, MARKER_SPIKE and MARKER_FILLED for each marker;
        CLEANUP_SKIPPED where there are too few frames or markers.
    """
    take, findings = without_blink_motion(take) if options.blinks else (take, [])
    on_face = np.array([name in markers for name in take.names])
    ever = np.flatnonzero(on_face & take.visible.any(axis=0))
    positions, seen = on_plane(take.positions[:, ever]), take.visible[:, ever]
    untouched = Cleaned(take, take.visible, ())
    if not (options.swaps or options.spikes or options.gaps):
        return untouched, findings
    spacing = _spacing(positions, seen) if len(ever) >= _FEWEST_MARKERS else 0.0
    usable = int((seen.sum(axis=1) >= _FEWEST_MARKERS).sum()) >= _FEWEST_FRAMES
    if spacing == 0.0 or not usable:
        return untouched, [*findings, finding("CLEANUP_SKIPPED", take.source)]
    is_searched = options.spikes and take.dimension == 3
    astray = find_strays(positions, seen) if is_searched else np.zeros_like(seen)
    seen = seen & ~astray
    positions = np.where(seen[..., None], positions, np.nan)
    swapped, start = np.zeros_like(seen), None
    if options.swaps:
        positions, seen, swapped, start = _unswapped(positions, seen, spacing, moving, neutral)
    stabilised = stabilise(
        positions, seen, moving=moving, start=start, rounds=_REFINED if start else ROUNDS
    )
    off = np.zeros_like(seen)
    if options.spikes:
        stabilised, off = _without_spikes(positions, seen, take.times, moving, stabilised)
    valid = seen & ~off
    new = np.zeros_like(seen)
    result = np.where(valid[..., None], positions, np.nan)
    if options.gaps and not valid.all():
        result, new = _filled(stabilised, valid, take.times, result)
    whole = take.positions.copy()
    whole[:, ever] = result[..., : take.dimension]
    names = tuple(take.names[i] for i in ever)
    repairs = (
        *_repairs(names, swapped, "swap"),
        *_repairs(names, off | astray, "spike"),
        *_repairs(names, new, "fill"),
    )
    if not repairs:
        return untouched, findings
    measured = take.visible.copy()
    measured[:, ever] = valid
    cleaned = Cleaned(replace(take, positions=whole), measured, repairs)
    return cleaned, findings + repair_findings(repairs)


def _spacing(positions: FloatArray, seen: BoolArray) -> float:
    """Return the median distance [m] between neighbouring markers; 0 if there is none."""
    place = positions[int(seen.sum(axis=1).argmax())]
    place = place[~np.isnan(place[:, 0])]
    if np.nanmax(np.abs(positions)) > _LARGEST:
        return 0.0
    if len(place) < 2:
        return 0.0
    return float(np.median(np.linalg.norm(place - place[nearest_points(place, 1)[:, 0]], axis=1)))


def _unswapped(
    positions: FloatArray,
    seen: BoolArray,
    spacing: float,
    moving: bool,
    neutral: tuple[int, int] | None,
) -> tuple[FloatArray, BoolArray, BoolArray, Pose]:
    """Put swapped labels right where the other markers predict them better so.

    Returns positions (F, M, 3), visible (F, M), swapped (F, M) and the head pose.
    """
    stabilised = stabilise(positions, seen, moving=moving, rounds=1)
    owner = assign_labels(stabilised.positions, seen, spacing, neutral)
    swapped: BoolArray = owner != np.arange(seen.shape[1])
    if not swapped.any():
        return positions, seen, swapped, stabilised.pose
    back = np.argsort(owner, axis=1)
    right = np.take_along_axis(positions, back[..., None], axis=1)
    right_seen = np.take_along_axis(seen, back, axis=1)
    touched = np.take_along_axis(swapped, back, axis=1)
    stabilised = stabilise(right, right_seen & ~touched, moving=moving, rounds=_REFINED)
    predicted = reconstruct(stabilised.model, stabilised.filled, right_seen & ~touched)
    before = np.linalg.norm(stabilised.pose.to_head(positions) - predicted, axis=2)
    after = np.linalg.norm(stabilised.pose.to_head(right) - predicted, axis=2)
    improvement = np.where(touched, np.nan_to_num(before) - np.nan_to_num(after), 0.0)
    better = _improved(owner, improvement)
    return (
        np.where(better[..., None], right, positions),
        np.where(better, right_seen, seen),
        better,
        stabilised.pose,
    )


def _improved(owner: IntArray, improvement: FloatArray) -> BoolArray:
    """Return where labels (F, M) are better exchanged, each swap of a frame by itself."""
    better = np.zeros(owner.shape, dtype=bool)
    states, which = np.unique(owner, axis=0, return_inverse=True)
    for k, state in enumerate(states):
        rows = np.flatnonzero(which.reshape(-1) == k)
        for cycle in cycles(state):
            at = np.ix_(rows, np.array(cycle))
            better[at] = improvement[at].sum(axis=1, keepdims=True) > 0.0
    return better


def _without_spikes(
    positions: FloatArray,
    seen: BoolArray,
    times: FloatArray,
    moving: bool,
    stabilised: StabilisedMarkers,
) -> tuple[StabilisedMarkers, BoolArray]:
    """Find spikes by prediction from markers without spikes, until nothing changes."""
    if moving:  # where the head's pose is unknown, so is where a marker belongs
        _, posed = rigid_fit(stabilised.filled, positions)
        seen = seen & posed[:, None]
    rate = 1.0 / frame_step(times)
    mean = stabilised.model.mean
    size = rms_radius(mean)
    # A spike also turns the head a little, and with it the others: markers that jump by their own
    # path alone are left out at first.
    off = find_spikes(
        stabilised.positions, np.zeros_like(stabilised.positions), seen, size=size, rate=rate
    )
    off[:, (seen & ~off).sum(axis=0) == 0] = False
    if off.any():
        stabilised = stabilise(
            positions, seen & ~off, moving=moving, start=stabilised.pose, rounds=_REFINED
        )
    for _ in range(_ROUNDS):
        predicted = predict_from_others(stabilised.model, stabilised.filled, seen & ~off)
        found = find_spikes(stabilised.positions, predicted, seen, size=size, rate=rate)
        # A marker keeps one good frame at least.
        found[:, (seen & ~found).sum(axis=0) == 0] = False
        if (found == off).all():
            break
        off = found
        stabilised = stabilise(
            positions, seen & ~off, moving=moving, start=stabilised.pose, rounds=_REFINED
        )
    return stabilised, off


def _filled(
    stabilised: StabilisedMarkers, valid: BoolArray, times: FloatArray, positions: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """Fill gaps in take space (F, M, 3); also return where."""
    model, whole_face = fit_low_rank_model(stabilised.positions, valid, stabilised.filled, _LONG)
    predicted = predict_from_others(model, whole_face, valid)
    known = np.asarray(valid.mean(axis=1) > 0.5)
    error = np.where(valid[..., None], stabilised.positions - predicted, np.nan)
    noise = white_noise(error.reshape(len(predicted), -1))
    filled = fill_gaps(
        stabilised.positions, valid, predicted, known=known, times=times, noise=noise
    )
    new = ~valid & _bridgeable(valid, known, times)
    return np.where(new[..., None], stabilised.pose.to_take(filled), positions), new


def _bridgeable(valid: BoolArray, known: BoolArray, times: FloatArray) -> BoolArray:
    """Return where a gap (F, M) can be filled: other markers are visible, or both ends near."""
    before = last_visible(valid)
    after = len(valid) - 1 - last_visible(valid[::-1])[::-1]
    rows = np.arange(valid.shape[1])
    ends = valid[before, rows] & valid[after, rows]
    often = valid.sum(axis=0) >= _FEWEST_FRAMES
    return np.asarray(often & (known[:, None] | (ends & (times[after] - times[before] <= _SHORT))))


def _repairs(names: tuple[str, ...], where: BoolArray, kind: Kind) -> list[Repair]:
    return [
        Repair(names[m], first, last, kind)
        for m in np.flatnonzero(where.any(axis=0))
        for first, last in frame_ranges(where[:, m])
    ]
