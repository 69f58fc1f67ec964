"""Known limits between blend shapes by their names, for rigs that do not declare them."""

from dataclasses import replace

import numpy as np

from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.face.plain_names import shape_keys

__all__ = ["with_known_limits"]

# Lips that close over an open jaw: "It doesn't work in isolation" (ICT-FaceKit, issue 5).
_KNOWN_LIMITS = (("mouthclose", "jawopen"),)


def with_known_limits(
    evaluator: BlendShapeEvaluator, names: tuple[str, ...]
) -> BlendShapeEvaluator:
    """Return the evaluator with the known limits of its blend shapes, in any spelling."""
    column = {key: i for i, key in enumerate(shape_keys(names))}
    pairs = [(column.get((low, "")), column.get((high, ""))) for low, high in _KNOWN_LIMITS]
    known = [pair for pair in pairs if None not in pair]
    limits = np.concatenate([evaluator.limits, np.array(known, np.int64).reshape(-1, 2)])
    return replace(evaluator, limits=np.unique(limits, axis=0))
