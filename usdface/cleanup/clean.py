"""A take, cleaned: swaps first, then spikes, then gaps, because each step needs the one before."""

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.cleanup.gaps import fill, runs
from usdface.cleanup.low_rank_model import fit_model, predict, restore
from usdface.cleanup.repairs import Kind, Repair, repair_findings
from usdface.cleanup.spikes import spikes
from usdface.cleanup.stabilise import Steady, steady
from usdface.cleanup.swaps import last_seen, owners
from usdface.findings import Finding, finding
from usdface.geometry.marker_spread import rms_radius
from usdface.geometry.rigid_fit import Pose
from usdface.options import CleanOptions
from usdface.retarget.neutral import on_plane
from usdface.retarget.noise import marker_noise
from usdface.takes import MarkerTake

__all__ = ["Cleaned", "clean_take"]

# Fewer say nothing about one another, or about the head.
_FEWEST_MARKERS = 6
_FEWEST_FRAMES = 16
_ROUNDS = 4
# What a long gap hides is learned slowly.
_LONG = 20
# Gaps [s] that a marker's own motion bridges where the other markers are lost as well.
_SHORT = 0.2
# Larger coordinates are no face, and their squares would overflow.
_LARGEST = 1e60


@dataclass(frozen=True, eq=False, slots=True)
class Cleaned:
    """A cleaned take.

    Attributes
    ----------
    take : MarkerTake
        Labels put right, spikes and gaps filled in where something is known about them.
    measured : (F, M) bool
        True where the take has what was recorded, not what was filled in.
    repairs : tuple of Repair
        By kind, marker and frame.
    """

    take: MarkerTake
    measured: BoolArray
    repairs: tuple[Repair, ...]


def clean_take(
    take: MarkerTake, markers: Collection[str], options: CleanOptions, moving: bool = True
) -> tuple[Cleaned, list[Finding]]:
    """Repair swaps, take out spikes and fill gaps.

    Parameters
    ----------
    take : MarkerTake
    markers : collection of str
        Labels of the face and head, in any order; others are left alone, and names that the
        take does not have are no matter.
    options : CleanOptions
    moving : bool
        False if the head's motion is out of the take already.

    Returns
    -------
    Cleaned
    list of Finding
        MARKER_SWAPPED, MARKER_SPIKE and MARKER_FILLED for each marker; CLEANUP_SKIPPED where
        frames or markers are too few to tell one from the other.
    """
    on_face = np.array([name in markers for name in take.names])
    ever = np.flatnonzero(on_face & take.visible.any(axis=0))
    positions, seen = on_plane(take.positions[:, ever]), take.visible[:, ever]
    untouched = Cleaned(take, take.visible, ())
    if not (options.swaps or options.spikes or options.gaps):
        return untouched, []
    spacing = _spacing(positions, seen) if len(ever) >= _FEWEST_MARKERS else 0.0
    usable = int((seen.sum(axis=1) >= _FEWEST_MARKERS).sum()) >= _FEWEST_FRAMES
    if spacing == 0.0 or not usable:
        return untouched, [finding("CLEANUP_SKIPPED", take.source)]
    swapped = np.zeros_like(seen)
    start = None
    if options.swaps:
        positions, seen, swapped, start = _unswapped(positions, seen, spacing, moving)
    held = steady(positions, seen, moving, start, rounds=2 if start else 4)
    off = np.zeros_like(seen)
    if options.spikes:
        held, off = _without_spikes(positions, seen, take.times, moving, held)
    believed = seen & ~off
    new = np.zeros_like(seen)
    result = np.where(believed[..., None], positions, np.nan)
    if options.gaps and not believed.all():
        result, new = _filled(held, believed, take.times, result)
    whole = take.positions.copy()
    whole[:, ever] = result[..., : take.dimension]
    names = tuple(take.names[i] for i in ever)
    repairs = (
        *_repairs(names, swapped, "swap"),
        *_repairs(names, off, "spike"),
        *_repairs(names, new, "fill"),
    )
    if not repairs:
        return untouched, []
    measured = take.visible.copy()
    measured[:, ever] = believed
    cleaned = Cleaned(replace(take, positions=whole), measured, repairs)
    return cleaned, repair_findings(repairs)


def _spacing(positions: FloatArray, seen: BoolArray) -> float:
    """Return the usual distance between neighbouring markers; 0 if there is no such thing."""
    place = positions[int(seen.sum(axis=1).argmax())]
    place = place[~np.isnan(place[:, 0])]
    if np.nanmax(np.abs(positions)) > _LARGEST:
        return 0.0
    apart = np.linalg.norm(place[:, None] - place, axis=2)
    np.fill_diagonal(apart, np.inf)
    return float(np.median(apart.min(axis=1))) if len(place) > 1 else 0.0


def _unswapped(
    positions: FloatArray, seen: BoolArray, spacing: float, moving: bool
) -> tuple[FloatArray, BoolArray, BoolArray, Pose]:
    """Put labels right where the other markers agree that it is better so.

    Return positions, what is seen, what was swapped, and the head's pose on the way.
    """
    held = steady(positions, seen, moving, rounds=1)
    owner = owners(held.still, seen, spacing)
    swapped: BoolArray = owner != np.arange(seen.shape[1])
    if not swapped.any():
        return positions, seen, swapped, held.pose
    back = np.argsort(owner, axis=1)
    right = np.take_along_axis(positions, back[..., None], axis=1)
    right_seen = np.take_along_axis(seen, back, axis=1)
    touched = np.take_along_axis(swapped, back, axis=1)
    held = steady(right, right_seen & ~touched, moving, rounds=2)
    told = restore(held.model, held.filled, right_seen & ~touched)
    before = np.linalg.norm(held.pose.to_head(positions) - told, axis=2)
    after = np.linalg.norm(held.pose.to_head(right) - told, axis=2)
    gain = np.where(touched, np.nan_to_num(before) - np.nan_to_num(after), 0.0).sum(axis=1)
    better = gain > 0.0
    return (
        np.where(better[:, None, None], right, positions),
        np.where(better[:, None], right_seen, seen),
        touched & better[:, None],
        held.pose,
    )


def _without_spikes(
    positions: FloatArray,
    seen: BoolArray,
    times: FloatArray,
    moving: bool,
    held: Steady,
) -> tuple[Steady, BoolArray]:
    """Find spikes with what the markers say that are none, until nothing changes."""
    rate = 1.0 / float(np.median(np.diff(times)))
    mean = held.model.mean
    size = rms_radius(mean)
    # A spike also turns the head a little, from which the others could tell it: those that jump
    # by their own path alone are not believed at first.
    off = spikes(held.still, np.zeros_like(held.still), seen, size, rate)
    off[:, (seen & ~off).sum(axis=0) == 0] = False
    if off.any():
        held = steady(positions, seen & ~off, moving, held.pose, rounds=2)
    for _ in range(_ROUNDS):
        told = predict(held.model, held.filled, seen & ~off)
        found = spikes(held.still, told, seen, size, rate)
        # A marker keeps one good frame at least.
        found[:, (seen & ~found).sum(axis=0) == 0] = False
        if (found == off).all():
            break
        off = found
        held = steady(positions, seen & ~off, moving, held.pose, rounds=2)
    return held, off


def _filled(
    held: Steady, believed: BoolArray, times: FloatArray, positions: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """Fill gaps in take space (F, M, 3); also return where."""
    model, whole_face = fit_model(held.still, believed, held.filled, _LONG)
    told = predict(model, whole_face, believed)
    known = np.asarray(believed.mean(axis=1) > 0.5)
    whole = np.asarray(believed.all(axis=1))
    error = np.where(believed[..., None], held.still - told, 0.0).reshape(len(told), -1)
    noise = marker_noise(error, whole)
    filled = fill(held.still, believed, told, known, times, noise)
    new = ~believed & _bridgeable(believed, known, times)
    return np.where(new[..., None], held.pose.to_take(filled), positions), new


def _bridgeable(believed: BoolArray, known: BoolArray, times: FloatArray) -> BoolArray:
    """Return where a gap (F, M) has something to go by: other markers, or both ends near."""
    before = last_seen(believed)
    after = len(believed) - 1 - last_seen(believed[::-1])[::-1]
    rows = np.arange(believed.shape[1])
    ends = believed[before, rows] & believed[after, rows]
    often = believed.sum(axis=0) >= _FEWEST_FRAMES
    return np.asarray(often & (known[:, None] | (ends & (times[after] - times[before] <= _SHORT))))


def _repairs(names: tuple[str, ...], where: BoolArray, kind: Kind) -> list[Repair]:
    return [
        Repair(names[m], first, last, kind)
        for m in np.flatnonzero(where.any(axis=0))
        for first, last in runs(where[:, m])
    ]
