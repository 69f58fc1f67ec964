"""Movements that rules are designed against: blend shapes alone, and several at a time."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from usdface.arrays import FloatArray, frozen
from usdface.face.symmetry import mirrored_pairs

__all__ = ["Movements", "movements", "single_movements"]

# Number of random draws of two to five movements at a time; a limit of time.
_DRAWS = 400
_AT_A_TIME = (2, 5)
# Weights of a drawn movement.
_LEAST, _WHOLE = 0.2, 1.0
_SEED = 7


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


def movements(shape_names: Sequence[str]) -> Movements:
    """Return the movements of a rig's blend shapes; the same for the same names."""
    return _movements(tuple(shape_names))


@lru_cache(maxsize=8)
def _movements(shape_names: tuple[str, ...]) -> Movements:
    single = single_movements(shape_names)
    sided = (single[len(shape_names) :] > 0).any(axis=0)
    whole = single[~((single.sum(axis=1) == 1) & (single @ sided > 0))]
    rng = np.random.default_rng(_SEED)
    mixed = np.zeros((_DRAWS if len(whole) > 1 else 0, len(shape_names)))
    for row in mixed:
        count = min(int(rng.integers(_AT_A_TIME[0], _AT_A_TIME[1] + 1)), len(whole))
        drawn = rng.choice(len(whole), size=count, replace=False)
        row[:] = (rng.uniform(_LEAST, _WHOLE, size=(count, 1)) * whole[drawn]).max(axis=0)
    return Movements(frozen(single), frozen(whole), frozen(mixed))


def single_movements(shape_names: Sequence[str]) -> FloatArray:
    """Return each blend shape alone, and those of both sides together: (N, S)."""
    alone = np.eye(len(shape_names))
    both = alone[mirrored_pairs(tuple(shape_names))].sum(axis=1)
    return np.concatenate([alone, both])
