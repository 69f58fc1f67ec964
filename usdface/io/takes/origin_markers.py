"""Places at 0, 0, 0, as some programs write those of markers that they did not see."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.findings import Finding, finding

__all__ = ["find_unseen", "lone_origins", "origin_markers", "shared_origins"]

_FEWEST = 3  # other markers, which show where the face is
_APART = 0.5  # of the extent of the others: the middle of a face is nearer to all of its markers
_AWAY = (
    0.1  # of the extent of all: 2 cm on a face, where a marker held near the origin stays within
)


def find_unseen(
    path: Path, labels: Sequence[str], positions: FloatArray
) -> tuple[BoolArray, list[Finding]]:
    """Return the entries (F, M) of a file at 0, 0, 0 that are no places, and MARKER_SPIKE."""
    found = []
    unseen = shared_origins(positions) | lone_origins(positions)
    if unseen.any():
        message = (
            "{place_count} places at 0, 0, 0, where several markers cannot be at once nor one jump "
            "to, are taken as occluded"
        )
        found.append(finding("MARKER_SPIKE", str(path), message, unseen.sum()))
    lost = origin_markers(np.where(unseen[..., None], np.nan, positions))
    if lost.any():
        message = "at 0, 0, 0 in all frames, far from the others; taken as never seen: {markers}"
        names = [labels[m] for m in np.flatnonzero(lost).tolist()]
        found.append(finding("MARKER_SPIKE", str(path), message, names))
    return unseen | lost, found


def shared_origins(positions: FloatArray) -> BoolArray:
    """Return the entries (F, M) that are at exactly 0, 0, 0 with another one of their frame.

    None where a take (F, M, 3) has no other places.
    """
    zero: BoolArray = np.all(positions == 0, axis=2)
    if (zero | np.isnan(positions).any(axis=2)).all():
        return np.zeros(zero.shape, bool)
    return np.asarray(zero & (zero.sum(axis=1, keepdims=True) > 1))


def lone_origins(positions: FloatArray) -> BoolArray:
    """Return the entries (F, M) at exactly 0, 0, 0 to which a marker jumps, and from which back.

    A marker that is near the origin just before or after passes it, or starts there.
    """
    zero: BoolArray = np.all(positions == 0, axis=2)
    known = ~zero & np.all(np.isfinite(positions), axis=2)
    ever = np.flatnonzero(known.any(axis=0))
    if not zero[:, ever].any() or len(ever) <= _FEWEST:
        return np.zeros(zero.shape, bool)
    places = np.nanmedian(np.where(known[:, ever, None], positions[:, ever], np.nan), axis=0)
    away = _AWAY * np.linalg.norm(np.ptp(places, axis=0))
    distances = np.linalg.norm(np.where(known[..., None], positions, np.inf), axis=2)
    back = _last_known(distances[::-1], known[::-1])[::-1]
    jumps = np.minimum(_last_known(distances, known), back)
    return np.asarray(zero & (jumps > away) & known.any(axis=0))


def _last_known(distances: FloatArray, known: BoolArray) -> FloatArray:
    """Return the distance (F, M) of the last frame up to each that is known; inf = none."""
    frames = np.where(known, np.arange(len(known))[:, None], 0)
    last = np.maximum.accumulate(frames, axis=0)
    return np.take_along_axis(distances, last, axis=0)


def origin_markers(positions: FloatArray) -> BoolArray:
    """Return the markers (M,) that are at exactly 0, 0, 0 wherever they are, and far from others.

    One among the others is kept: in a take that is held at a marker that is its place.

    Parameters
    ----------
    positions : (F, M, 3) float64
        In any unit; NaN where occluded.
    """
    known: BoolArray = np.all(np.isfinite(positions), axis=2)
    ever: BoolArray = np.any(known, axis=0)
    at_origin: BoolArray = ever & np.all(np.all(positions == 0, axis=2) | ~known, axis=0)
    others = np.flatnonzero(ever & ~at_origin)
    if not at_origin.any() or len(others) < _FEWEST:
        return np.zeros(len(at_origin), bool)
    places = np.nanmedian(np.where(known[:, others, None], positions[:, others], np.nan), axis=0)
    extent = np.linalg.norm(np.ptp(places, axis=0))
    nearest = np.linalg.norm(places, axis=1).min()
    return np.asarray(at_origin & (nearest > _APART * extent))
