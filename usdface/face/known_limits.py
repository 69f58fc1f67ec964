"""Limits between blend shapes that are known by name, where the rig does not declare them."""

from dataclasses import replace

import numpy as np

from usdface.blend_shape_evaluator import BlendShapeEvaluator
from usdface.face.shape_names import shape_key

__all__ = ["with_known_limits"]

# "It doesn't work in isolation" (ICT-FaceKit, issue 5): lips that close over an open jaw.
_KNOWN_LIMITS = (("mouthclose", "jawopen"),)


def with_known_limits(model: BlendShapeEvaluator, names: tuple[str, ...]) -> BlendShapeEvaluator:
    """Return the model with the limits that are known by the shapes' names, in any spelling."""
    place = {shape_key(name): i for i, name in enumerate(names)}
    pairs = [(place.get((low, "")), place.get((high, ""))) for low, high in _KNOWN_LIMITS]
    known = [pair for pair in pairs if None not in pair]
    limits = np.concatenate([model.limits, np.array(known, np.int64).reshape(-1, 2)])
    return replace(model, limits=np.unique(limits, axis=0))
