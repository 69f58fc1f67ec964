import numpy as np
from curved_world import make_curved_world

from usdface.blend_shapes.combined_weights import with_combinations
from usdface.blend_shapes.vertex_evaluator import evaluator_of

RNG = np.random.default_rng(2)
MESH = make_curved_world().rig.meshes[0]
MODEL, _ = evaluator_of(MESH.shapes, np.zeros(0, np.int64))


def test_other_columns_keep_their_weights() -> None:
    names = ("other", *MESH.shape_names)
    weights = RNG.random((3, len(names)))
    found = with_combinations(MESH.shapes, names, weights)
    np.testing.assert_array_equal(found[:, 0], weights[:, 0])
    np.testing.assert_allclose(found[:, 1:], MODEL.complete(weights[:, 1:][:, MODEL.free]))
