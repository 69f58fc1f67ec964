"""The side that a face looks to, and the turn that lets it look to the front."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from slits import slit_face
from worlds import make_world

from usdface.face.facing import (
    facing,
    has_equal_halves,
    turn_about_up,
    turn_to_front,
    yaw_of,
)
from usdface.geometry.bake_transform import bake_transform


@pytest.mark.parametrize("degrees", [-170.0, -90.0, -20.0, 0.0, 15.0, 90.0, 135.0])
def test_a_face_looks_where_its_skin_does(degrees: float) -> None:
    world = make_world()
    mesh, bound = world.rig.meshes[0], np.arange(0, len(world.rig.meshes[0].points), 3)
    ahead = facing(mesh, bound).yaw
    assert ahead == pytest.approx(0.0, abs=5.0)
    turned = replace(mesh, points=mesh.points @ turn_about_up(degrees)[:3, :3])
    assert facing(turned, bound).yaw == pytest.approx(ahead + degrees, abs=1e-6)


@pytest.mark.parametrize("degrees", [-170.0, -90.0, 0.0, 40.0, 180.0])
def test_without_markers_the_skin_that_the_blend_shapes_move_tells(degrees: float) -> None:
    mesh = make_world().rig.meshes[0]
    turn = turn_about_up(degrees)[:3, :3]
    shapes = tuple(replace(shape, offsets=shape.offsets @ turn) for shape in mesh.shapes)
    ahead = facing(mesh, np.zeros(0, np.int64)).yaw
    assert ahead == pytest.approx(0.0, abs=5.0)
    turned = replace(mesh, points=mesh.points @ turn, shapes=shapes)
    looks = facing(turned, np.zeros(0, np.int64)).yaw
    assert looks is not None
    assert (looks - ahead - degrees + 180.0) % 360.0 == pytest.approx(180.0, abs=1e-6)


def test_faces_that_are_inside_out_look_to_the_other_side() -> None:
    mesh = make_world().rig.meshes[0]
    corners = mesh.face_indices.reshape(-1, int(mesh.face_counts[0]))
    turned = replace(mesh, face_indices=corners[:, ::-1].ravel())
    bound = np.arange(0, len(mesh.points), 3)
    assert facing(turned, bound).yaw == pytest.approx(facing(mesh, bound).yaw, abs=1e-9)


def test_a_face_without_faces_or_markers_looks_nowhere() -> None:
    mesh = make_world().rig.meshes[0]
    none = np.zeros(0, np.int64)
    assert facing(replace(mesh, shapes=()), none).yaw is None
    assert facing(replace(mesh, face_counts=none, face_indices=none), np.array([0])).yaw is None
    up = mesh.points @ Rotation.from_euler("x", 90, degrees=True).as_matrix()
    assert facing(replace(mesh, points=up), np.arange(len(up))).yaw is None


@pytest.mark.parametrize("pitch", [90.0, 70.0, -90.0])
def test_a_face_that_looks_up_or_down_lies(pitch: float) -> None:
    """As one with z up in a file that says y."""
    mesh = make_world().rig.meshes[0]
    bound, none = np.arange(0, len(mesh.points), 3), np.zeros(0, np.int64)
    turn = Rotation.from_euler("x", pitch, degrees=True).as_matrix()
    shapes = tuple(replace(shape, offsets=shape.offsets @ turn) for shape in mesh.shapes)
    lying = replace(mesh, points=mesh.points @ turn, shapes=shapes)
    for markers in (bound, none):
        assert facing(lying, markers).pitch == pytest.approx(pitch, abs=5.0)


@pytest.mark.parametrize("degrees", [0.0, 40.0, -40.0])
def test_a_face_that_is_bent_does_not_lie(degrees: float) -> None:
    mesh = make_world().rig.meshes[0]
    turn = Rotation.from_euler("x", degrees, degrees=True).as_matrix()
    bent = replace(mesh, points=mesh.points @ turn)
    assert facing(bent, np.arange(0, len(mesh.points), 3)).pitch is None
    assert facing(replace(mesh, shapes=()), np.zeros(0, np.int64)).pitch is None


@pytest.mark.parametrize("scale", [(0.01,) * 3, (1.0, 1.0, 1.0), (-2.0, 2.0, 2.0)])
@pytest.mark.parametrize("up", [0.0, -90.0])
def test_the_yaw_of_a_transform_is_that_about_the_up_axis(
    up: float, scale: tuple[float, float, float]
) -> None:
    """Whatever the unit and the axis that was up, also of a mirrored character."""
    axes = Rotation.from_euler("x", up, degrees=True).as_matrix().T
    matrix = turn_about_up(40.0)
    matrix[:3, :3] = np.diag(scale) @ axes @ matrix[:3, :3]
    matrix[3, :3] = 1.0, 2.0, 3.0
    assert yaw_of(matrix) == pytest.approx(40.0)


def test_a_character_on_its_head_has_no_yaw() -> None:
    assert yaw_of(np.diag([1.0, -1.0, -1.0, 1.0])) == 0.0


@pytest.mark.parametrize(
    ("looks", "yaw", "expected"),
    [
        (3.0, 0.0, 0.0),  # markers that are not symmetric
        (38.0, 0.0, 0.0),  # those of one half of the face
        (43.0, 40.0, -40.0),
        (75.0, 40.0, -40.0),
        (-178.0, 180.0, -180.0),
        (2.0, 1.0, -1.0),
        (1.0, -2.0, 2.0),
        (4.0, 90.0, 0.0),  # modelled along x, put right by the stage
        (91.0, 0.0, -90.0),  # modelled along x
        (-85.0, 0.0, 90.0),
        (179.0, 0.0, -180.0),  # modelled along -z, as VRM 0.x
        (-160.0, 0.0, 180.0),
        (140.0, 0.0, 0.0),
    ],
)
def test_a_face_is_turned_back_by_exactly_what_turned_it(
    looks: float, yaw: float, expected: float
) -> None:
    assert turn_to_front(looks, yaw) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("looks", "own", "expected"),
    [
        (75.0, 69.0, -69.0),  # a turn that was applied to the points
        (140.0, 137.0, -137.0),
        (50.0, 45.0, -45.0),
        (88.0, 80.0, -90.0),  # modelled along x, with halves that are not equal
        (75.0, 0.0, -90.0),  # blend shapes that say something else
        (38.0, 40.0, 0.0),
    ],
)
def test_blend_shapes_tell_a_turn_that_no_stage_knows(
    looks: float, own: float, expected: float
) -> None:
    assert turn_to_front(looks, 0.0, own) == pytest.approx(expected)


@pytest.mark.parametrize("degrees", [-44.0, -20.0, 20.0, 35.0])
def test_equal_halves_tell_a_turn_of_the_points_that_markers_do_not(degrees: float) -> None:
    turned = bake_transform(slit_face(), turn_about_up(degrees))
    own = facing(turned, np.zeros(0, np.int64)).yaw
    assert own == pytest.approx(degrees, abs=0.5)
    assert has_equal_halves(turned, own) and not has_equal_halves(turned, 0.0)
    for uneven in (0.0, 20.0, -20.0):
        assert turn_to_front(degrees + uneven, 0.0, own, equal=True) == -own
    assert turn_to_front(degrees, 0.0, own) == 0.0
    # A stage that turns it by as much is exact.
    assert turn_to_front(degrees, degrees + 3.0, own, equal=True) == -degrees - 3.0


def test_blend_shapes_of_one_half_tell_no_turn() -> None:
    face = slit_face()
    left = tuple(s for s in face.shapes if s.name.endswith("Left"))
    half = replace(face, shapes=left)
    own = facing(half, np.zeros(0, np.int64)).yaw
    assert own is None or not has_equal_halves(half, 20.0)
    assert not has_equal_halves(replace(face, shapes=()), 0.0)
