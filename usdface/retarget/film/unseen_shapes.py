"""Blend shapes that move no marker of a take: they stay at 0."""

from dataclasses import replace

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.blend_shapes.evaluator import BlendShapeEvaluator

__all__ = ["unseen_shapes", "without_shapes"]

# Of the largest movement: less is rounding.
_NOTHING = 1e-9


def unseen_shapes(basis: FloatArray) -> BoolArray:
    """Return which shapes (S,) move no marker, by their offsets (S, M, D).

    In an image (D = 2) also those that move straight towards the camera: of a head that does not
    turn, perspective shows only noise of them.
    """
    moved = np.abs(basis).max(axis=(1, 2))
    return np.asarray(moved <= _NOTHING * moved.max())


def without_shapes(model: BlendShapeEvaluator, left_out: BoolArray) -> BlendShapeEvaluator:
    """Return the shapes with some of them (S,) that move nothing."""
    paths = tuple(
        replace(path, displacements=np.where(left_out[path.shape], 0.0, path.displacements))
        for path in model.inbetweens
    )
    offsets = np.where(left_out[:, None], 0.0, model.offsets)
    return replace(model, offsets=offsets, inbetweens=paths)
