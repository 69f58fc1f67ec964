"""Movements that rules are designed against: blend shapes alone, and several at a time."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from usdface.arrays import BoolArray, FloatArray, frozen
from usdface.face.bound_face import BoundFace
from usdface.face.symmetry import mirrored_pairs

__all__ = [
    "Movements",
    "in_columns",
    "mixed_movements",
    "movements",
    "moving_shapes",
    "single_movements",
]

# Number of random draws of two to five movements at a time; a limit of time.
_DRAWS = 400
_AT_A_TIME = (2, 5)
# Weights of a drawn movement.
_LEAST, _WHOLE = 0.2, 1.0
_SEED = 7
# Displacement of a marker on a human face [m] below which a blend shape does not move it.
_STILL = 1e-6


@dataclass(frozen=True, eq=False, slots=True)
class Movements:
    """Weights of blend shapes that mean no emotion by themselves.

    Attributes
    ----------
    single : (N, S) float64
        Each blend shape alone, and those of both sides together.
    whole : (W, S) float64
        Those of `single` that move both halves of the face.
    mixed : (R, S) float64
        Several of `whole` at a time, at random, as in speech or a range of motion.
    """

    single: FloatArray
    whole: FloatArray
    mixed: FloatArray


def moving_shapes(face: BoundFace) -> tuple[tuple[str, ...], BoolArray]:
    """Return the blend shapes of a face of human size that move a marker, and which these are (S,).

    Combination shapes do not by themselves.
    """
    names = face.shape_names
    moved = np.abs(np.nan_to_num(face.displacements(np.eye(len(names)))))
    moves = np.asarray((moved > _STILL).any(axis=(1, 2)))
    return tuple(name for name, own in zip(names, moves, strict=True) if own), moves


def in_columns(rows: FloatArray, columns: BoolArray) -> FloatArray:
    """Return rows (N, S') in those of S columns that are True, 0 in the others: (N, S)."""
    wide = np.zeros((len(rows), len(columns)))
    wide[:, columns] = rows
    return wide


def movements(shape_names: Sequence[str]) -> Movements:
    """Return the movements of a rig's blend shapes; the same for the same names."""
    return _movements(tuple(shape_names))


@lru_cache(maxsize=8)
def _movements(shape_names: tuple[str, ...]) -> Movements:
    single, whole = single_movements(shape_names), _whole(shape_names)
    rng = np.random.default_rng(_SEED)
    mixed = np.zeros((_DRAWS if len(whole) > 1 else 0, len(shape_names)))
    for row in mixed:
        count = min(int(rng.integers(_AT_A_TIME[0], _AT_A_TIME[1] + 1)), len(whole))
        drawn = rng.choice(len(whole), size=count, replace=False)
        row[:] = (rng.uniform(_LEAST, _WHOLE, size=(count, 1)) * whole[drawn]).max(axis=0)
    return Movements(frozen(single), frozen(whole), frozen(mixed))


def mixed_movements(shape_names: Sequence[str], count: int, rng: np.random.Generator) -> FloatArray:
    """Return `count` mixtures of movements, as `Movements.mixed`, at once; none of fewer than two.

    Parameters
    ----------
    shape_names : sequence of str
    count : int
    rng : numpy.random.Generator

    Returns
    -------
    (count, S) float64
    """
    whole = _whole(tuple(shape_names))
    mixed = np.zeros((count if len(whole) > 1 else 0, len(shape_names)))
    most = rng.integers(_AT_A_TIME[0], _AT_A_TIME[1] + 1, size=(len(mixed), 1))
    ranks = rng.random((len(mixed), len(whole))).argsort(axis=1)
    strengths = rng.uniform(_LEAST, _WHOLE, size=ranks.shape) * (ranks < most)
    for strength, movement in zip(strengths.T, whole, strict=True):
        np.maximum(mixed, strength[:, None] * movement, out=mixed)
    return mixed


def _whole(shape_names: tuple[str, ...]) -> FloatArray:
    """Return the single movements that move both halves of the face: (W, S)."""
    single = single_movements(shape_names)
    sided = (single[len(shape_names) :] > 0).any(axis=0)
    return np.asarray(single[~((single.sum(axis=1) == 1) & (single @ sided > 0))])


def single_movements(shape_names: Sequence[str]) -> FloatArray:
    """Return each blend shape alone, and those of both sides together: (N, S)."""
    alone = np.eye(len(shape_names))
    both = alone[mirrored_pairs(tuple(shape_names))].sum(axis=1)
    return np.concatenate([alone, both])
