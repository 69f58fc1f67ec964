"""Takes whose weights are known: a face performs recorded curves, another one may be the target.

Everything random is drawn from the world's own seed, so that a table can be made again.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.solve.faces import Face, bent, example, has_real_data, ict, makehuman
from usdface.arrays import BoolArray, FloatArray
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake

__all__ = ["METRES_PER_PIXEL", "REST", "World", "worlds"]

# Neutral frames before each take; they are not scored.
REST = 15
# The recorded curves: settings were found on the first half, the second one is scored.
TRAINED, SCORED = slice(0, 2015), slice(2015, 4030)
PERFORMER = 0.004  # m, bend of another performer
ANATOMY = 0.25
METRES_PER_PIXEL = 1e-4
MOVING_HEAD = "head moves"


@dataclass(frozen=True, eq=False)
class World:
    """A take with known weights.

    Attributes
    ----------
    name : str
    target : Face
    truth : (F, S)
        Without the neutral frames before.
    still : (REST + F, M, D)
        The take without its head motion: what the other solvers are given.
    moving : (REST + F, M, D)
        What ours is given.
    noise : float [m]
    neutral_known : bool
        The performer is the target, whose neutral is known; else it is that of the first frames.
    """

    name: str
    target: Face
    truth: FloatArray
    still: FloatArray
    moving: FloatArray
    noise: float
    neutral_known: bool
    head_moves: bool

    @property
    def times(self) -> FloatArray:
        return np.arange(len(self.still)) / self.target.rate

    @property
    def neutral(self) -> FloatArray:
        """Return where the still markers rest: (M, D)."""
        return self.target.neutral if self.neutral_known else np.nanmean(self.still[:REST], axis=0)

    @property
    def take(self) -> MarkerTake:
        return MarkerTake(self.target.names, self.times, self.moving, self.target.rate)

    @property
    def setup(self) -> RetargetSetup:
        binding = Binding(self.target.names, self.target.points)
        head = "solve" if self.head_moves else "stabilised"
        return RetargetSetup(
            binding, head=head, neutral=None if self.neutral_known else (0, REST - 1)
        )


Defect = Callable[[FloatArray, np.random.Generator, float], None]


def perform(
    name: str,
    target: Face,
    noise: float = 3e-4,
    seed: int = 0,
    performer: Face | None = None,
    head_moves: bool = False,
    defect: Defect | None = None,
    flat: bool = False,
    anatomy: float = ANATOMY,
    part: slice = SCORED,
) -> World:
    """Let a face perform curves; `performer` is who it is, if it is not the target itself."""
    rng = np.random.default_rng(seed)
    truth = target.curves[part]
    source = performer or target
    offsets = source.offsets
    if performer is not None:
        offsets = other_ways(source.neutral, offsets, rng, anatomy)
    played = np.concatenate([np.zeros((REST, truth.shape[1])), truth])
    flat_offsets = offsets.reshape(len(offsets), -1)
    clean = source.neutral + (played @ flat_offsets).reshape(len(played), *source.neutral.shape)
    if performer is not None:
        clean = 1.1 * clean
    jitter = noise * rng.standard_normal(clean.shape)
    if flat:  # an orthographic image
        clean, jitter = clean[..., :2] / METRES_PER_PIXEL, jitter[..., :2] / METRES_PER_PIXEL
    moving = (nodding(clean, target.rate) if head_moves else clean) + jitter
    still = clean + jitter
    if defect is not None:
        for positions in (still, moving):
            defect(positions[REST:], np.random.default_rng(seed + 1), target.rate)
    known = performer is None and not flat
    return World(name, target, truth, still, moving, noise, known, head_moves)


def other_ways(
    neutral: FloatArray, offsets: FloatArray, rng: np.random.Generator, anatomy: float
) -> FloatArray:
    """Give another person's movements: each shape 0.8 to 1.25 as strong, and in its own way.

    At every marker its offset is turned and stretched at random, smoothly over 3 cm of skin: by
    `anatomy` [rad] about each axis, and by that share.
    """
    count = len(offsets)
    away = np.linalg.norm(neutral[:, None] - neutral, axis=2)
    smooth = np.linalg.cholesky(np.exp(-((away / 0.03) ** 2) / 2) + 1e-6 * np.eye(len(neutral)))
    drawn = anatomy * rng.standard_normal((count, 4, len(neutral))) @ smooth.T
    turn = Rotation.from_rotvec(drawn[:, :3].transpose(0, 2, 1).reshape(-1, 3))
    turned = turn.apply(offsets.reshape(-1, 3)).reshape(offsets.shape)
    return rng.uniform(0.8, 1.25, (count, 1, 1)) * (1.0 + drawn[:, 3, :, None]) * turned


def nodding(positions: FloatArray, rate: float) -> FloatArray:
    """Turn the head by up to 8 degrees and move it by a centimetre."""
    times = np.arange(len(positions)) / rate
    swing = np.sin(np.outer(times, [1.1, 0.7, 0.9])) * [6, 8, 4]
    turn = Rotation.from_euler("xyz", swing, degrees=True).as_matrix()
    shift = 0.01 * np.sin(times[:, None] * [0.8, 0.5, 0.3])
    return np.asarray(positions @ turn.transpose(0, 2, 1) + shift[:, None])


def gaps(share: float) -> Defect:
    """Hide markers for 0.1 to 4 s at a time until so much of the take is hidden."""

    def hide(positions: FloatArray, rng: np.random.Generator, rate: float) -> None:
        count, markers = positions.shape[:2]
        hidden: BoolArray = np.zeros((count, markers), dtype=bool)
        while hidden.mean() < share:
            length = round(rate * np.exp(rng.uniform(np.log(0.1), np.log(4.0))))
            start = rng.integers(0, max(1, count - length))
            hidden[start : start + length, rng.integers(markers)] = True
        positions[hidden] = np.nan

    return hide


def swaps(positions: FloatArray, rng: np.random.Generator, rate: float) -> None:
    """Exchange two neighbours for 0.2 to 3 s, once every ten seconds."""
    count, markers = positions.shape[:2]
    for _ in range(round(count / rate / 10) + 1):
        length = round(rate * rng.uniform(0.2, 3.0))
        start, one = rng.integers(0, max(1, count - length)), rng.integers(markers)
        rows = slice(start, start + length)
        away = np.linalg.norm(positions[start] - positions[start, one], axis=1)
        pair = [one, int(np.argsort(away)[rng.integers(1, 4)])]
        positions[rows, pair] = positions[rows, pair[::-1]]


def spikes(positions: FloatArray, rng: np.random.Generator, rate: float) -> None:
    """Throw a marker off by 5 to 30 mm for one to three frames, once a second."""
    count, markers, axes = positions.shape
    for _ in range(round(count / rate)):
        start, length = rng.integers(0, max(1, count - 3)), rng.integers(1, 4)
        way = rng.normal(size=axes)
        thrown = rng.uniform(0.005, 0.030) * way / np.linalg.norm(way)
        positions[start : start + length, rng.integers(markers)] += thrown


def lost(positions: FloatArray, rng: np.random.Generator, rate: float) -> None:
    """Lose one marker from the first moving frame to the last."""
    positions[:, rng.integers(positions.shape[1])] = np.nan


def worlds(data: Path, quick: bool = False) -> Iterator[World]:
    """Yield the rows of the table."""
    real = has_real_data(data)
    face = ict(data) if real else example()
    part = SCORED if real else slice(0, None)
    if quick:
        part = slice(part.start, part.start + 300)

    def world(name: str, target: Face = face, **settings: object) -> World:
        return perform(name, target, part=part, **settings)  # type: ignore[arg-type]

    for noise in (0.0, 1e-4, 3e-4, 1e-3):
        yield world(f"noise {1000 * noise:g} mm", noise=noise)
    yield world(MOVING_HEAD, head_moves=True)
    yield world("head moves, 1 mm", head_moves=True, noise=1e-3)
    yield world("gaps, 20 %", defect=gaps(0.2))
    yield world("swapped labels", defect=swaps)
    yield world("spikes", defect=spikes)
    yield world("a lost marker", defect=lost)
    yield world("2D image", flat=True)
    for seed in (1, 2):
        yield world(f"other performer {seed}", performer=bent(face, seed, PERFORMER), seed=seed)
    for size in (0.004, 0.015):
        target = bent(face, 50, size)
        performer = bent(face, 3, PERFORMER)
        yield world(f"stylised {1000 * size:g} mm", target, performer=performer, seed=3)
    if not real or quick:
        return
    for markers in (24, 41, 150):
        yield world(f"{markers} markers", ict(data, markers))
    other = makehuman(data)
    yield world("MakeHuman", other)
    yield world("MakeHuman, other performer", other, performer=bent(other, 4, PERFORMER), seed=4)
