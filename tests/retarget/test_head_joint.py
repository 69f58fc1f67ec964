import numpy as np
from body_skeleton import skeleton

from usdface.face.face_points import FacePoints
from usdface.retarget.head_joint import carrying_joint
from usdface.rigs import Skin


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
