"""Pairs of mirrored blend shapes, and of those that turn both eyes alike, by name."""

import numpy as np

from usdface.arrays import IntArray
from usdface.face.expression_poses import units_of
from usdface.face.gaze_curves import GAZE_UNITS
from usdface.face.plain_names import plain_names, shape_keys
from usdface.face.shape_names import DIRECTIONS, rig_keys

__all__ = ["gaze_pairs", "mirrored_pairs", "symmetric_pairs"]

# Left and right of these exclude each other.
_DIRECTIONS = DIRECTIONS | {"eyelookin", "eyelookout"}


def mirrored_pairs(names: tuple[str, ...]) -> IntArray:
    """Return the left and the right shape of each pair: (P, 2) int64 into `names`.

    Names are read in any spelling: ``mouthSmileLeft``, ``mouthSmile_L``, ``eye-left-slit``.
    """
    return np.array([pair for _, pair in _pairs(names)], dtype=np.int64).reshape(-1, 2)


def symmetric_pairs(names: tuple[str, ...]) -> IntArray:
    """Return the `mirrored_pairs` that can act together: (P, 2) int64 into `names`.

    Directions as in ``jawLeft``, and of the eyes' look inwards and outwards, are left out.
    """
    sides = [pair for base, pair in _pairs(names) if base not in _DIRECTIONS]
    return np.array(sides, dtype=np.int64).reshape(-1, 2)


def gaze_pairs(names: tuple[str, ...]) -> IntArray:
    """Return the left and the right eye's shape for each direction of gaze: (P, 2) int64.

    As ``eyeLookOutLeft`` and ``eyeLookInRight``. Shapes that turn both eyes are in none.
    """
    units = units_of(names)
    of_side = {name: side for name, (_, side) in zip(names, shape_keys(names), strict=True)}
    directions = []
    for unit in GAZE_UNITS:
        sides = {of_side[name]: name for name, own in units.items() if unit in own}
        if {"left", "right"} <= sides.keys():
            directions.append((names.index(sides["left"]), names.index(sides["right"])))
    return np.array(directions, dtype=np.int64).reshape(-1, 2)


def _pairs(names: tuple[str, ...]) -> list[tuple[str, tuple[int, int]]]:
    sides: dict[str, dict[str, int]] = {}
    plain = plain_names(names)
    for i, (base, side) in enumerate(rig_keys([plain[name] for name in names])):
        if side:
            sides.setdefault(base, {}).setdefault(side, i)
    return [(b, (own["left"], own["right"])) for b, own in sides.items() if len(own) == 2]
