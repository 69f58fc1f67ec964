"""The markers that features are measured on, of either half of a face."""

from dataclasses import replace

import numpy as np
import pytest
from worlds import World, make_world

from usdface.arrays import FloatArray
from usdface.correction.sided_markers import character_markers
from usdface.face.bound_face import bound_face
from usdface.face.mirror import SIDES, Side
from usdface.retarget.bound_points import BoundPoints
from usdface.retarget.solve_take import solve_take


def _sided_motion(world: World, moved: FloatArray) -> dict[Side, FloatArray]:
    """Return the motion of each side's markers where the character stands elsewhere."""
    mesh, setup = world.rig.meshes[0], world.setup(neutral=(0, 3), nose_tip="nose")
    mesh = replace(mesh, points=mesh.points + moved)
    noise = 3e-4 * np.random.default_rng(0).standard_normal(world.take.positions.shape)
    take = replace(world.take, positions=world.take.positions + noise)
    points = setup.binding.points
    bound = BoundPoints.linear(mesh.points[points], mesh.offsets_at(points), mesh.shape_names)
    solution, _ = solve_take(take, bound, setup)
    face = bound_face(mesh, setup)
    _, neutral, by_side = character_markers(face, solution.weights, solution, SIDES, ())
    return {side: positions(slice(None)) - neutral for side, positions in by_side.items()}


@pytest.mark.parametrize("moved", [[1.0, 0.3, -2.0], [1e-6, 0.0, 0.0]], ids=str)
def test_rounding_does_not_give_markers_of_the_midline_to_one_side(moved: list[float]) -> None:
    world = make_world()
    expected, found = (_sided_motion(world, np.array(by)) for by in ([0.0, 0.0, 0.0], moved))
    for side in SIDES:
        np.testing.assert_allclose(found[side], expected[side], atol=1e-9)
