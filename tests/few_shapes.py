"""Four blend shapes of one vertex, of which some combine others."""

import numpy as np

from usdface.blend_shapes.blend_shape import BlendShape, Combination
from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.blend_shapes.vertex_evaluator import evaluator_of


def few_shapes(**combinations: Combination) -> tuple[BlendShapeEvaluator, list[str]]:
    index, offsets = np.array([0]), np.array([[0.0, 0.01, 0.0]])
    shapes = tuple(
        BlendShape(n, index, offsets, combination=combinations.get(n)) for n in ("a", "b", "c", "d")
    )
    model, findings = evaluator_of(shapes, index)
    return model, [f"{f.code} {f.where}" for f in findings]
