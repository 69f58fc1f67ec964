import numpy as np
import pytest

from usdface.clips import Clip, JointsTake
from usdface.io.transforms import compose
from usdface.io.usd.joint_frames import with_unit_scales
from usdface.rigs import Skeleton

JOINTS = ("a", "a/b", "a/b/c")
IDENTITY = np.array([0, 0, 0, 1.0])


def world_of(matrices: np.ndarray) -> np.ndarray:
    world = matrices.copy()
    for k in (1, 2):
        world[k] = matrices[k] @ world[k - 1]
    return world


def a_chain(sizes: list[float]) -> tuple[Skeleton, JointsTake]:
    rng = np.random.default_rng(1)
    scales = np.array(sizes)[:, None] * np.ones(3)
    turns = rng.normal(size=(3, 4))
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    rest = compose(rng.normal(size=(3, 3)), turns, scales)
    skeleton = Skeleton(JOINTS, JOINTS, world_of(rest), rest)
    moves = rng.normal(size=(4, 3, 3))
    return skeleton, JointsTake(
        JOINTS, np.arange(4.0), moves, np.tile(turns, (4, 1, 1)), np.tile(scales, (4, 1, 1))
    )


@pytest.mark.parametrize("sizes", [[0.01, 1, 1], [0.3, 0.7, 11.0], [100.0, 0.01, 1.7]])
def test_frames_have_unit_scales_and_skin_as_before(sizes: list[float]) -> None:
    skeleton, take = a_chain(sizes)
    same, (clip,), found = with_unit_scales(skeleton, (Clip("c", None, take),))
    assert found == [] and clip.joints is not None
    np.testing.assert_allclose(clip.joints.scales, 1, atol=1e-12)
    for frame in range(4):
        parts = [(t.translations, t.rotations, t.scales) for t in (take, clip.joints)]
        before, after = (world_of(compose(*(p[frame] for p in part))) for part in parts)
        skinned = np.linalg.inv(skeleton.bind) @ before
        np.testing.assert_allclose(np.linalg.inv(same.bind) @ after, skinned, atol=1e-9)


def test_what_16_bits_hold_stays() -> None:
    skeleton, take = a_chain([1.0, 0.5, 2.0])
    clips = (Clip("c", None, take), Clip("d"))
    assert with_unit_scales(skeleton, clips) == (skeleton, clips, [])


def test_scales_that_move_between_16_bit_numbers_are_announced() -> None:
    skeleton, take = a_chain([1.0, 1.0, 1.0])
    scales = np.array(take.scales)
    scales[2, 1] = 0.7001
    grown = JointsTake(JOINTS, take.times, take.translations, take.rotations, scales)
    found = with_unit_scales(skeleton, (Clip("grows", None, grown),))[2]
    assert [(f.code, f.where) for f in found] == [("SCALE_ROUNDED", "grows")]


def test_a_joint_that_is_scaled_to_nothing_stays_as_it_is() -> None:
    skeleton, take = a_chain([0.3, 0.0, 1.0])
    same, (clip,), _ = with_unit_scales(skeleton, (Clip("c", None, take),))
    assert clip.joints is not None
    assert np.isfinite(same.rest).all() and np.isfinite(clip.joints.scales).all()
    np.testing.assert_array_equal(clip.joints.scales[:, 1], 0)
