"""The error of takes in which some markers do not show the skin they are bound to."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.performers.shown_neutral import BUILT_ON_20_S, JUDGED_ON_20_S
from benchmarks.performers.worlds import JUDGED_ON, ROWS, Performance, perform
from benchmarks.solve.faces import Face
from benchmarks.solve.worlds import nodding
from usdface.arrays import FloatArray

__all__ = ["TRACKS", "with_tracks"]

# Markers, and how far they are off [m].
_SLIPS, _SLIP = 2, 0.004
_DRIFTS, _DRIFT = 4, 0.003
_TREMBLES, _TREMBLE = 4, 0.0015

TRACKS = (
    "nothing",
    f"{_SLIPS} slip by {1000 * _SLIP:g} mm in the middle",
    f"{_DRIFTS} drift by {1000 * _DRIFT:g} mm",
    f"{_TREMBLES} tremble by {1000 * _TREMBLE:g} mm",
    "2 neighbours bound the wrong way round",
)


def with_tracks(data: Path, number: int, name: str, face: Face) -> Performance:
    """Return 20 s of performer `number` with the fault `name` of `TRACKS`."""
    part = JUDGED_ON_20_S if number in JUDGED_ON else BUILT_ON_20_S
    take = perform(data, number, ROWS[0], part=part)
    rng = np.random.default_rng([3000, number])
    if name == TRACKS[4]:
        marker = int(rng.integers(len(take.bound)))
        apart = np.linalg.norm(take.neutral - take.neutral[marker], axis=1)
        both = [marker, int(np.argsort(apart)[1])]
        bound = take.bound.copy()
        bound[both] = bound[both[::-1]]
        return replace(take, bound=bound)
    off = _faults(name, rng, take.still.shape)
    still = take.still + off
    # The head turns little enough for the fault to be as large in its space.
    return replace(take, still=still, positions=take.positions + nodding(still, face.rate)
                   - nodding(take.still, face.rate))  # fmt: skip


def _faults(name: str, rng: np.random.Generator, shape: tuple[int, ...]) -> FloatArray:
    """Return how far the markers are off: (F, M, 3) [m]."""
    off = np.zeros(shape)
    if name == TRACKS[1]:
        for marker in rng.choice(shape[1], _SLIPS, replace=False):
            off[shape[0] // 2 :, marker] = _way(rng, _SLIP)
    if name == TRACKS[2]:
        for marker in rng.choice(shape[1], _DRIFTS, replace=False):
            off[:, marker] = np.linspace(0.0, 1.0, shape[0])[:, None] * _way(rng, _DRIFT)
    if name == TRACKS[3]:
        some = rng.choice(shape[1], _TREMBLES, replace=False)
        off[:, some] = rng.normal(scale=_TREMBLE, size=(shape[0], _TREMBLES, 3))
    return off


def _way(rng: np.random.Generator, length: float) -> FloatArray:
    way = rng.normal(size=3)
    return np.asarray(length * way / np.linalg.norm(way))
