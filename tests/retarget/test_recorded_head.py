"""The head of a phone's recording on a character: rotations known, about a point that stays."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from worlds import World, make_world

from usdface.arrays import FloatArray
from usdface.retarget.recorded_head import recorded_head
from usdface.rigs import Mesh, Rig, Skeleton, Skin
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import WeightsTake

FRAMES = 12
NO_MARKERS = Binding((), np.zeros(0, dtype=np.int64))
SETUP = RetargetSetup(NO_MARKERS, neutral=(0, 0))


@pytest.fixture(scope="module")
def world() -> World:
    return make_world()


def a_take(turns: FloatArray | None) -> WeightsTake:
    times, weights = np.arange(FRAMES) / 30.0, np.zeros((FRAMES, 1))
    return WeightsTake(("jawOpen",), times, weights, 30.0, head=turns)


def turning(seed: int = 0) -> FloatArray:
    return 0.4 * np.random.default_rng(seed).normal(size=(FRAMES, 3))


def with_joints(world: World) -> tuple[Rig, Mesh, FloatArray]:
    """Return a rig whose joint "neck/head" carries the face, and the joint's place."""
    mesh, place = world.rig.meshes[0], np.array([0.01, 0.05, -0.08])
    bind = np.tile(np.eye(4), (2, 1, 1))
    bind[1, 3, :3] = place
    skeleton = Skeleton(("neck", "neck/head"), ("neck", "head"), bind, bind)
    count = len(mesh.points)
    skin = Skin(np.ones((count, 1), dtype=np.int64), np.ones((count, 1)))
    skinned = replace(mesh, skin=skin)
    return replace(world.rig, meshes=(skinned,), skeleton=skeleton), skinned, place


def test_a_take_without_a_recorded_head_moves_none(world: World) -> None:
    assert recorded_head(a_take(None), world.rig, world.rig.meshes[0], SETUP) == (None, [])


def test_the_head_turns_about_its_joint_from_the_neutral(world: World) -> None:
    rig, mesh, place = with_joints(world)
    turns = turning()
    motion, findings = recorded_head(a_take(turns), rig, mesh, SETUP)
    assert motion is not None and findings == []
    np.testing.assert_allclose(
        motion.to_take(np.tile(place, (FRAMES, 1, 1))) - place, 0, atol=1e-15
    )
    own = Rotation.from_rotvec(turns)
    expected = (own[0].inv() * own).as_matrix()
    np.testing.assert_allclose(motion.rotations, expected, atol=1e-14)
    np.testing.assert_allclose(motion.rotations[0], np.eye(3), atol=1e-14)


def test_the_direction_of_the_camera_does_not_matter(world: World) -> None:
    """A phone that stands elsewhere turns all recorded rotations by the same."""
    rig, mesh, _ = with_joints(world)
    elsewhere = Rotation.from_rotvec([0.5, -0.3, 0.2]) * Rotation.from_rotvec(turning())
    one, other = (
        recorded_head(a_take(turns), rig, mesh, replace(SETUP, neutral=(2, 5)))[0]
        for turns in (turning(), elsewhere.as_rotvec())
    )
    assert one is not None and other is not None
    np.testing.assert_allclose(one.rotations, other.rotations, atol=1e-12)


def test_a_neutral_of_the_rig_keeps_the_angles(world: World) -> None:
    rig, mesh, _ = with_joints(world)
    turns = turning()
    motion, _ = recorded_head(a_take(turns), rig, mesh, replace(SETUP, neutral=None))
    assert motion is not None
    np.testing.assert_allclose(
        motion.rotations, Rotation.from_rotvec(turns).as_matrix(), atol=1e-14
    )


def test_a_body_without_a_joint_of_the_head_stays_still(world: World) -> None:
    face = world.rig.meshes[0]
    height = np.ptp(face.points[:, 1])
    body = replace(face, points=np.concatenate([face.points, face.points - [0, 5 * height, 0]]))
    rig = replace(world.rig, meshes=(body,))
    motion, findings = recorded_head(a_take(turning()), rig, body, SETUP)
    assert motion is None and [found.code for found in findings] == ["HEAD_LEFT_STILL"]
    bust = replace(face, points=np.concatenate([face.points, face.points - [0, height, 0]]))
    assert recorded_head(a_take(turning()), rig, bust, SETUP)[0] is not None
    without = replace(face, shapes=())
    motion, findings = recorded_head(a_take(turning()), rig, without, SETUP)
    assert motion is None and [found.code for found in findings] == ["HEAD_LEFT_STILL"]


def test_a_root_joint_may_be_the_head(world: World) -> None:
    mesh = world.rig.meshes[0]
    place = np.eye(4)[None].copy()
    place[0, 3, :3] = 0.0, -0.1, -0.05
    skin = Skin(np.zeros((len(mesh.points), 1), np.int64), np.ones((len(mesh.points), 1)))
    skinned, skeleton = replace(mesh, skin=skin), Skeleton(("j",), ("Head_M",), place, place)
    rig = replace(world.rig, meshes=(skinned,), skeleton=skeleton)
    motion, findings = recorded_head(a_take(turning()), rig, skinned, SETUP)
    assert motion is not None and not findings
    at = motion.to_take(np.tile(place[0, 3, :3], (FRAMES, 1, 1)))
    np.testing.assert_allclose(at - place[0, 3, :3], 0.0, atol=1e-15)


@pytest.mark.parametrize("root", [True, False])
def test_without_a_joint_of_the_head_it_turns_about_its_middle(world: World, root: bool) -> None:
    """Behind the face, half as deep as the head; a root joint may be at the feet."""
    front = world.rig.meshes[0]
    back = front.points - [0.0, 0.0, 0.2]
    mesh = replace(front, points=np.concatenate([front.points, back]))
    rig = replace(world.rig, meshes=(mesh,))
    if root:
        skin = Skin(np.zeros((len(mesh.points), 1), np.int64), np.ones((len(mesh.points), 1)))
        feet = np.eye(4)[None].copy()
        feet[0, 3, 1] = -1.6
        mesh = replace(mesh, skin=skin)
        rig = replace(rig, meshes=(mesh,), skeleton=Skeleton(("root",), ("root",), feet, feet))
    motion, findings = recorded_head(a_take(turning()), rig, mesh, SETUP)
    assert motion is not None and [found.code for found in findings] == ["HEAD_PIVOT_ASSUMED"]
    # Two turns about different axes leave one point in its place.
    turned = np.concatenate([motion.rotations[k] - np.eye(3) for k in (3, 7)])
    moved = np.concatenate([motion.translations[k] for k in (3, 7)])
    pivot, rest, *_ = np.linalg.lstsq(turned, -moved, rcond=None)
    assert rest == pytest.approx(0.0, abs=1e-20)
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    middle = (low + high) / 2
    np.testing.assert_allclose(pivot[[0, 2]], middle[[0, 2]], atol=0.02)
    assert front.points[:, 1].min() < pivot[1] < front.points[:, 1].max()


def test_markers_say_which_joint_carries_the_face(world: World) -> None:
    rig, mesh, place = with_joints(world)
    bound = Binding(("a", "b"), np.array([3, 40]))
    motion, findings = recorded_head(a_take(turning()), rig, mesh, replace(SETUP, binding=bound))
    assert motion is not None and not findings
    named, findings = recorded_head(a_take(turning()), rig, mesh, replace(SETUP, head_joint="neck"))
    assert named is not None and not findings
    np.testing.assert_allclose(named.translations, 0.0, atol=1e-15)  # the neck is at the origin
    assert np.abs(motion.translations).max() > 0.005 and place.any()
