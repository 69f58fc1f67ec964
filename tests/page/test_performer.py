from dataclasses import replace

import numpy as np
import pytest
from worlds import make_world

from usdface.face.bound_face import bound_face
from usdface.geometry.marker_spread import marker_spread
from usdface.geometry.rigid_fit import rigid_fit
from usdface.page.performer import markers_on_face
from usdface.retarget.joint_motion import matrices_of
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake


def bound(world, neutral=(0, 0)):
    mesh = world.rig.meshes[0]
    binding = Binding(tuple(world.points), np.array([*world.points.values()]))
    setup = RetargetSetup(binding, neutral=neutral, nose_tip=next(iter(world.points)))
    return setup, bound_face(mesh, setup)


def test_markers_come_onto_their_vertices_whatever_their_space_and_size() -> None:
    world = make_world(head_moves=False)
    setup, face = bound(world)
    expected = face.neutral + face.displacements(world.weights)
    turn = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    elsewhere = replace(world.take, positions=3.0 * world.take.positions @ turn + (1, 2, 3))
    shown = markers_on_face(elsewhere, setup, face, np.zeros((0, 4, 4)))
    np.testing.assert_allclose(shown, expected, atol=1e-6)


def test_the_head_stands_still() -> None:
    world, still = make_world(), make_world(head_moves=False)
    setup, face = bound(world)
    pose, _ = rigid_fit(still.take.positions, world.take.positions)
    shown = markers_on_face(world.take, setup, face, matrices_of(pose))
    expected = markers_on_face(still.take, setup, face, np.zeros((0, 4, 4)))
    np.testing.assert_allclose(shown, expected, atol=1e-6)


def test_occluded_markers_stay_hidden_and_few_bound_ones_are_shown_all_the_same() -> None:
    world = make_world(head_moves=False)
    positions = world.take.positions.copy()
    positions[5, 2] = np.nan
    take = replace(world.take, positions=positions)
    setup, _ = bound(world)
    two = replace(setup, binding=Binding(setup.binding.markers[:2], setup.binding.points[:2]))
    for each in (setup, two):
        face = bound_face(world.rig.meshes[0], each)
        shown = markers_on_face(take, each, face, np.zeros((0, 4, 4)))
        assert np.isnan(shown).any(axis=2).sum() == 1 and np.isnan(shown[5, 2]).all()


def test_a_spike_is_hidden_and_leaves_the_others_where_they_are() -> None:
    world = make_world(head_moves=False)
    positions = world.take.positions.copy()
    positions[20, 3] = 1e4
    setup, face = bound(world)
    spiked = replace(world.take, positions=positions)
    shown = markers_on_face(spiked, setup, face, np.zeros((0, 4, 4)))
    expected = markers_on_face(world.take, setup, face, np.zeros((0, 4, 4)))
    assert np.isnan(shown[20, 3]).all()
    shown[20, 3] = expected[20, 3]
    np.testing.assert_array_equal(shown, expected)


@pytest.mark.parametrize("unit", [1.0, 0.01, 1e4])
def test_markers_that_no_place_fits_to_the_face_have_its_size(unit: float) -> None:
    """Pixels of an image lay far outside the picture, a small performer was a speck."""
    world = make_world(head_moves=False)
    mesh = world.rig.meshes[0]
    setup = RetargetSetup(Binding((), np.zeros(0, np.int64)), neutral=(0, 0))
    pixels = unit * world.take.positions[..., :2] + (640.0, 480.0)
    take = MarkerTake(world.take.names, world.take.times, pixels, world.take.rate)
    shown = markers_on_face(take, setup, bound_face(mesh, setup), np.zeros((0, 4, 4)))[0]
    skin = np.unique(np.concatenate([shape.indices for shape in mesh.shapes]))
    assert marker_spread(shown) == pytest.approx(marker_spread(mesh.points[skin]))
    np.testing.assert_allclose(shown.mean(axis=0), mesh.points[skin].mean(axis=0), atol=1e-6)
