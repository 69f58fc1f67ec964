"""The small world with bent paths: lids and jaw with inbetweens, combination shapes."""

from dataclasses import replace

import numpy as np
from worlds import World, make_world

from usdface.blend_shapes.vertex_evaluator import evaluator_of
from usdface.geometry.rigid_fit import rigid_fit
from usdface.rigs import BlendShape, Combination, Inbetween

__all__ = ["COMBINED", "make_curved_world"]

COMBINED = {
    "smileOpenLeft": Combination(("jawOpen", "mouthSmileLeft")),
    "smileOpenRight": Combination(("jawOpen", "mouthSmileRight")),
    "browsWorried": Combination(("browDownLeft", "browInnerUp"), "min"),
}


def _bent(shape: BlendShape) -> BlendShape:
    """Half way the skin bulges forward by a third of the way, as a lid over the eyeball."""
    if not shape.name.startswith(("eyeBlink", "jawOpen")):
        return shape
    bulge = np.abs(shape.offsets[:, 1:2]) * [0.0, 0.0, 1.0 / 3.0]
    half = Inbetween("half", 0.5, 0.5 * shape.offsets + bulge)
    return replace(
        shape, inbetweens=(half, Inbetween("over", 0.75, 0.8 * shape.offsets + 0.5 * bulge))
    )


def make_curved_world(*, head_moves: bool = True) -> World:
    """Make it; `weights` are of all shapes, those of combinations too."""
    plain = make_world(head_moves=head_moves)
    mesh = plain.rig.meshes[0]
    shapes = [_bent(shape) for shape in mesh.shapes]
    for name, combination in COMBINED.items():
        on = mesh.shapes[mesh.shape_names.index(combination.of[1])]
        offsets = -0.4 * on.offsets + np.abs(on.offsets[:, 1:2]) * [0.0, 0.0, 0.3]
        shapes.append(BlendShape(name, on.indices, offsets, combination=combination))
    bent = replace(mesh, shapes=tuple(shapes))
    at = np.array(list(plain.points.values()))
    model, _ = evaluator_of(bent.shapes, at)
    weights = model.complete(plain.weights)
    positions = bent.points[at] + model.displacements(weights).reshape(len(weights), -1, 3)
    if head_moves:
        still = make_world(head_moves=False).take.positions
        pose, _ = rigid_fit(still, plain.take.positions)
        positions = pose.to_take(positions)
    take = replace(plain.take, positions=positions)
    return World(replace(plain.rig, meshes=(bent,)), plain.points, weights, take)
