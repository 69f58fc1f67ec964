"""Weights in which combination shapes follow their parents."""

import numpy as np

from usdface.arrays import FloatArray
from usdface.blend_shapes.blend_shape import BlendShape
from usdface.blend_shapes.vertex_evaluator import evaluator_of

__all__ = ["combined_shapes", "with_combinations"]


def combined_shapes(shapes: tuple[BlendShape, ...]) -> frozenset[str]:
    """Return the names of combination shapes, whose weights follow those of their parents."""
    evaluator, _ = evaluator_of(shapes, np.zeros(0, np.int64))
    return frozenset(shapes[combination.shape].name for combination in evaluator.combinations)


def with_combinations(
    shapes: tuple[BlendShape, ...], names: tuple[str, ...], weights: FloatArray
) -> FloatArray:
    """Return weights (F, T) of columns `names` in which combination shapes follow their parents."""
    evaluator, _ = evaluator_of(shapes, np.zeros(0, np.int64))
    if not evaluator.combinations or not {shape.name for shape in shapes} <= set(names):
        return weights
    columns = [names.index(shape.name) for shape in shapes]
    result = weights.copy()
    result[:, columns] = evaluator.combined(weights[:, columns])
    return result
