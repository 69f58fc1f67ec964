import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from usdface.clips import Clip, JointsTake
from usdface.page.clip_data import TICKS_PER_SECOND, clip_data, joint_motion
from usdface.rigs import Skeleton
from usdface.takes import WeightsTake


def test_frames_are_those_of_the_clip() -> None:
    weights = np.random.default_rng(0).random((31, 2))
    take = WeightsTake(("b", "a"), 0.5 + np.arange(31) / 30, weights, 30.0)
    data, cut = clip_data(Clip("talk", take), ("a", "c", "b"), None)
    assert not cut and (data["name"], data["rate"]) == ("talk", 30.0)
    shown = data["weights"]["corrected"].values
    np.testing.assert_allclose(shown[:, [2, 0]], weights, atol=1e-9)
    assert not shown[:, 1].any()
    np.testing.assert_allclose(data["ticks"], np.arange(31) / 30 * TICKS_PER_SECOND, atol=0.5)


def test_few_keys_are_drawn_smoothly() -> None:
    take = WeightsTake(("a",), [0.0, 1.0], [[0.0], [1.0]], 1.0)
    data, _ = clip_data(Clip("", take), ("a",), None)
    assert data["rate"] == 60.0
    shown = data["weights"]["corrected"].values[:, 0]
    np.testing.assert_allclose(shown, np.arange(61) / 60, atol=1e-12)


def test_joints_turn_along_the_shortest_arc() -> None:
    turn = Rotation.from_euler("y", [[0.0], [90.0]], degrees=True).as_quat()
    turn[1] *= -1  # the same rotation
    one = np.ones((2, 1, 3))
    joints = JointsTake(("root",), [0.0, 1.0], one * [[[0]], [[2]]], turn[:, None], one)
    rest = np.eye(4)[None]
    skeleton = Skeleton(("root",), ("root",), rest, rest)
    motion = joint_motion(joints, skeleton, np.linspace(-0.5, 1.0, 7))
    assert motion is not None and motion["joints"] == [0]
    turned = Rotation.from_quat(motion["rotations"].values[:, 0]).as_euler("YXZ", degrees=True)
    np.testing.assert_allclose(turned[:, 0], [0, 0, 0, 22.5, 45, 67.5, 90], atol=1e-5)
    np.testing.assert_allclose(motion["translations"].values[:, 0, 0], [0, 0, 0, 0.5, 1, 1.5, 2])
    steps = (motion["rotations"].values[1:] * motion["rotations"].values[:-1]).sum(axis=2)
    assert (steps > 0.9).all()


def test_nothing_moves_without_joints() -> None:
    assert joint_motion(None, None, np.zeros(1)) is None


def test_a_clip_that_is_too_long_is_cut(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("usdface.page.clip_data._MOST", 20)
    take = WeightsTake(("a",), np.arange(41) / 30, np.zeros((41, 1)), 30.0)
    data, cut = clip_data(Clip("long", take), ("a",), None)
    assert cut and len(data["ticks"]) == 20
