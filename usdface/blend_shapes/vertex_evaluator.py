"""The evaluator of the blend shapes of a mesh, at some of its vertices."""

from dataclasses import replace

import numpy as np

from usdface.arrays import IntArray
from usdface.blend_shapes.blend_shape import BlendShape, offsets_at
from usdface.blend_shapes.combination_weight import CombinationWeight, in_order
from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.blend_shapes.inbetween_path import InbetweenPath, distinct_inbetweens, inbetween_path
from usdface.findings import Finding, finding

__all__ = ["evaluator_of"]

_CIRCULAR = "it builds on itself or nothing"


def evaluator_of(
    shapes: tuple[BlendShape, ...], vertices: IntArray
) -> tuple[BlendShapeEvaluator, list[Finding]]:
    """Return the evaluator of the S shapes of a mesh at its `vertices` (M,), N = 3 M.

    Returns
    -------
    BlendShapeEvaluator
    list of Finding
        COMBINATION_IGNORED for shapes that build on missing ones, or on themselves.
    """
    names = {shape.name: i for i, shape in enumerate(shapes)}
    paths = tuple(
        _path_at(number, shape, vertices)
        for number, shape in enumerate(shapes)
        if distinct_inbetweens(shape)
    )
    combinations: list[CombinationWeight] = []
    limits: list[tuple[int, int]] = []
    findings: list[Finding] = []
    declared = {s.name: s.combination for s in shapes if s.combination is not None}
    for name, combination in declared.items():
        unknown = [parent for parent in combination.of if parent not in names]
        if unknown or name in combination.of or not combination.of:
            if unknown:
                message = "it builds on {shape!r}"
                findings.append(finding("COMBINATION_IGNORED", name, message, unknown[0]))
            else:
                findings.append(finding("COMBINATION_IGNORED", name, _CIRCULAR))
        elif combination.rule == "limit":
            limits += [(names[name], names[parent]) for parent in combination.of]
        else:
            parents = np.array([names[parent] for parent in combination.of])
            least = combination.rule == "min"
            combinations.append(CombinationWeight(names[name], parents, least))
    ordered, circular = in_order(combinations)
    findings += [finding("COMBINATION_IGNORED", shapes[c.shape].name, _CIRCULAR) for c in circular]
    offsets = offsets_at(shapes, vertices).reshape(len(shapes), 3 * len(vertices))
    pairs = np.array(limits, np.int64).reshape(-1, 2)
    return BlendShapeEvaluator(offsets, paths, ordered, pairs), findings


def _path_at(number: int, shape: BlendShape, vertices: IntArray) -> InbetweenPath:
    path = inbetween_path(shape, number)
    knots = path.displacements.reshape(len(path.weights), -1, 3)
    shapes = (BlendShape(str(k), shape.indices, offsets) for k, offsets in enumerate(knots))
    at = offsets_at(tuple(shapes), vertices)
    return replace(path, displacements=at.reshape(len(knots), -1))
