import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from usdface.errors import InputError
from usdface.face.face_points import FacePoints
from usdface.geometry.rigid_fit import Pose
from usdface.retarget.head_joint import carrying_joint, joint_track, named_joint
from usdface.rigs import Skeleton, Skin

JOINTS = (
    "hips",
    "hips/neck",
    "hips/neck/head",
    "hips/neck/head/jaw",
    "hips/neck/head/eye",
    "hips/arm",
)
NAMES = ("Hips", "Neck", "Head", "Jaw", "Eye", "Arm")


def place(rotation: list[float], translation: list[float]) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_rotvec(rotation).as_matrix().T
    matrix[3, :3] = translation
    return matrix


REST = np.array([place([0.1 * k, 0.2, -0.3], [0.1, 0.4, 0.02 * k]) for k in range(6)])
PARENTS = [-1, 0, 1, 2, 2, 0]


def worlds(local: np.ndarray) -> np.ndarray:
    result: list[np.ndarray] = []
    for k, parent in enumerate(PARENTS):
        result.append(local[k] if parent < 0 else local[k] @ result[parent])
    return np.array(result)


def skeleton(bind: np.ndarray | None = None) -> Skeleton:
    return Skeleton(JOINTS, NAMES, worlds(REST) if bind is None else bind, REST)


def skin(*shares: dict[int, float]) -> Skin:
    joints = np.array([[*share, *[0] * (3 - len(share))] for share in shares])
    weights = np.array([[*share.values(), *[0.0] * (3 - len(share))] for share in shares])
    return Skin(joints, weights)


def face(*vertices: int) -> FacePoints:
    return FacePoints(np.array(vertices), np.full(len(vertices), 1.0 / len(vertices)))


def test_the_head_carries_what_jaw_and_lids_move() -> None:
    bound = skin({3: 1.0}, {3: 0.5, 2: 0.5}, {4: 1.0}, {2: 1.0}, {1: 0.9, 2: 0.1}, {5: 1.0})
    assert carrying_joint(skeleton(), bound, face(0, 1, 2, 3)) == 2
    # Where all of it hangs on the jaw, the jaw it is; an arm and a face have the hips only.
    assert carrying_joint(skeleton(), bound, face(0)) == 3
    assert carrying_joint(skeleton(), bound, face(3, 5)) == 0
    assert carrying_joint(skeleton(), skin({0: 0.0}), face(0)) is None


def test_an_arm_of_a_small_share_is_no_reason_to_turn_the_hips() -> None:
    bound = skin({2: 1.0}, {5: 1.0})
    assert carrying_joint(skeleton(), bound, FacePoints(np.arange(2), np.array([0.95, 0.05]))) == 2
    assert carrying_joint(skeleton(), bound, FacePoints(np.arange(2), np.array([0.85, 0.15]))) == 0


def test_a_joint_is_named_by_its_path_or_its_own_name() -> None:
    assert named_joint(skeleton(), "hips/neck") == 1
    assert named_joint(skeleton(), "head") == named_joint(skeleton(), "Head") == 2
    with pytest.raises(InputError, match="no joints named 'tail'"):
        named_joint(skeleton(), "tail")
    twice = Skeleton(
        ("a", "a/b", "a/c"),
        ("x", "y", "y"),
        np.tile(np.eye(4), (3, 1, 1)),
        np.eye(4)[None].repeat(3, 0),
    )
    with pytest.raises(InputError, match="2 joints named 'y'"):
        named_joint(twice, "y")


MOTION = Pose(
    Rotation.from_rotvec([[0.2, -0.1, 0.3], [0.0, 0.4, 0.0]]).as_matrix(),
    np.array([[0.01, 0.02, -0.03], [0.0, 0.1, 0.0]]),
)


def test_the_skin_of_the_joint_and_all_below_it_move_as_the_head() -> None:
    """Skinning by hand: bound as it rests, so that inv(bind) @ world is the motion itself."""
    rig = skeleton()
    track = joint_track(rig, 2, MOTION)
    point = np.array([0.3, 1.2, 0.1, 1.0])
    for frame, local in enumerate(track):
        moved = worlds(np.concatenate([REST[:2], local[None], REST[3:]]))
        expected = MOTION.to_take(np.tile(point[:3], (2, 1, 1)))[frame, 0]
        for joint, follows in enumerate([False, False, True, True, True, False]):
            skinned = (point @ np.linalg.inv(rig.bind[joint]) @ moved[joint])[:3]
            np.testing.assert_allclose(skinned, expected if follows else point[:3], atol=1e-12)


def test_no_motion_is_the_rest_pose_also_where_that_is_not_the_bind_pose() -> None:
    bent = worlds(REST) @ place([0.5, 0.0, 0.0], [0.0, 1.0, 0.0])
    track = joint_track(skeleton(bent), 2, Pose.identity(2))
    np.testing.assert_allclose(track, np.broadcast_to(REST[2], (2, 4, 4)), atol=1e-12)
