"""A take of weights on a rig with a combination shape."""

from dataclasses import replace

from worlds import make_world

from usdface.blend_shapes.blend_shape import BlendShape, Combination
from usdface.face.bound_face import bound_face
from usdface.retarget_take.recorded_weights import recorded_weights
from usdface.setup.pin import Pin
from usdface.takes import WeightsTake


def test_a_pin_of_a_combination_shape_is_reported_as_not_kept() -> None:
    world = make_world()
    mesh = world.rig.meshes[0]
    one, other = mesh.shapes[:2]
    both = BlendShape(
        "both", one.indices, one.offsets, combination=Combination((one.name, other.name))
    )
    mesh = replace(mesh, shapes=(*mesh.shapes, both))
    take = WeightsTake(world.rig.shape_names, world.take.times, world.weights, 60.0)
    pins = (Pin("both", [3], [0.9]), Pin(one.name, [3], [0.5]), Pin(other.name, [3], [0.5]))
    setup = replace(world.setup(), pins=pins)
    weights, findings = recorded_weights(take, bound_face(mesh, setup), setup)
    column = weights.names.index("both")
    assert weights.weights[3, column] == 0.25
    assert [(f.code, f.where) for f in findings] == [("PIN_IGNORED", "both")]
