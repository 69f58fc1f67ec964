import numpy as np
import pytest
from body_skeleton import REST, place, skeleton, worlds
from scipy.spatial.transform import Rotation

from usdface.errors import InputError
from usdface.geometry.rigid_fit import Pose
from usdface.retarget.joint_motion import JointMotion, joint_track, named_joint
from usdface.rigs import Skeleton


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
    track = joint_track(rig, JointMotion(2, MOTION))
    point = np.array([0.3, 1.2, 0.1, 1.0])
    for frame, local in enumerate(track):
        moved = worlds(np.concatenate([REST[:2], local[None], REST[3:]]))
        expected = MOTION.to_take(np.tile(point[:3], (2, 1, 1)))[frame, 0]
        for joint, follows in enumerate([False, False, True, True, True, False]):
            skinned = (point @ np.linalg.inv(rig.bind[joint]) @ moved[joint])[:3]
            np.testing.assert_allclose(skinned, expected if follows else point[:3], atol=1e-12)


def test_no_motion_is_the_rest_pose_also_where_that_is_not_the_bind_pose() -> None:
    bent = worlds(REST) @ place([0.5, 0.0, 0.0], [0.0, 1.0, 0.0])
    track = joint_track(skeleton(bent), JointMotion(2, Pose.identity(2)))
    np.testing.assert_allclose(track, np.broadcast_to(REST[2], (2, 4, 4)), atol=1e-12)
