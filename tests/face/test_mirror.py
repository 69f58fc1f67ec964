"""Left and right: the halves of a face, read and driven on their own."""

import numpy as np
import pytest
from slits import slit_face

from usdface.face.mirror import half_face, half_weights, midline, mirrored_markers, sided_shapes

NAMES = ("nose", "brow_l", "brow_r", "corner_l", "corner_r", "chin", "odd")
NEUTRAL = np.array(
    [
        [0.002, 0, 0.1],
        [0.032, 0.05, 0.08],
        [-0.028, 0.0502, 0.08],
        [0.022, -0.05, 0.09],
        [-0.018, -0.05, 0.09],
        [0.0025, -0.08, 0.09],
        [0.06, 0.0, 0.0],
    ]
)


def test_every_marker_finds_its_mirror_image():
    middle = NEUTRAL[0, 0]
    found = [NAMES[i] if i >= 0 else "" for i in mirrored_markers(NEUTRAL, middle)]
    assert found == ["nose", "brow_r", "brow_l", "corner_r", "corner_l", "chin", ""]


@pytest.mark.parametrize("start", [0.002, 0.0, 0.005])
def test_the_midline_is_half_way_between_mirror_images(start):
    assert midline(NEUTRAL, start) == pytest.approx(0.002)
    assert midline(NEUTRAL[5:], 0.01) == 0.01  # nothing to go by


@pytest.mark.parametrize(("side", "own", "other"), [("left", "l", "r"), ("right", "r", "l")])
def test_a_half_face_is_a_half_and_its_mirror_image(side, own, other):
    moved = np.random.default_rng(2).normal(scale=0.01, size=(5, len(NAMES), 3))
    moved[2, NAMES.index(f"brow_{own}")] = np.nan
    found = half_face(NEUTRAL + moved, NEUTRAL, NEUTRAL, 0, side) - NEUTRAL
    for name in ("brow", "corner"):
        kept, made = (NAMES.index(f"{name}_{s}") for s in (own, other))
        np.testing.assert_allclose(found[:, kept], moved[:, kept], atol=1e-12)
        np.testing.assert_allclose(found[:, made], moved[:, kept] * [-1, 1, 1], atol=1e-12)
    for name in ("nose", "chin"):  # on the midline
        np.testing.assert_allclose(
            found[:, NAMES.index(name)], moved[:, NAMES.index(name)] * [0, 1, 1], atol=1e-12
        )
    odd = NAMES.index("odd")  # has no counterpart
    np.testing.assert_allclose(found[:, odd], moved[:, odd], atol=1e-12)


def test_half_weights_are_those_of_one_side_on_both():
    weights = np.array([[0.1, 0.2, 0.3, 0.4, 0.5]])
    pairs = np.array([[0, 3], [4, 1]])
    np.testing.assert_array_equal(half_weights(weights, pairs, "left"), [[0.1, 0.5, 0.3, 0.1, 0.5]])
    np.testing.assert_array_equal(
        half_weights(weights, pairs, "right"), [[0.4, 0.2, 0.3, 0.4, 0.2]]
    )
    assert weights[0, 3] == 0.4  # the input is as it was
    np.testing.assert_array_equal(half_weights(weights, pairs[:0], "left"), weights)


def test_both_halves_of_a_symmetric_motion_are_the_whole():
    moved = np.random.default_rng(2).normal(scale=0.01, size=(3, len(NAMES), 3))
    moved[:, [0, 5], 0] = 0.0
    moved[:, [2, 4]] = moved[:, [1, 3]] * [-1, 1, 1]
    for side in ("left", "right"):
        found = half_face(NEUTRAL + moved, NEUTRAL, NEUTRAL, 0, side)
        np.testing.assert_allclose(found, NEUTRAL + moved, atol=1e-12)


def test_shapes_belong_to_the_half_that_they_move():
    left, right = sided_shapes(slit_face(), 0.0)
    assert set(left) == {n[: -len("Right")] + "Left" for n in right}
    assert all(name.endswith("Left") for name in left) and len(left) >= 5
    assert "mouthPressLeft" not in left  # it moves two thirds of the lip
