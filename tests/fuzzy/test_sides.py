"""Left and right: the halves of a face, read and driven on their own."""

import numpy as np
import pytest
from slits import slit_face

from usdface.fuzzy.sides import halved, mirrored_markers, sided_shapes
from usdface.fuzzy.system import Variable

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
INPUTS = (
    Variable("a", "input", "brow_right", "x", "signed"),
    Variable("b", "input", "corner_l", "y", "signed"),
    Variable("c", "input", "odd", "x", "signed"),
    Variable("d", "input", "brow_right", "x", "absolute"),
    Variable("e", "input", "chin", "y", "signed"),
)
ROLES = {"brow_right": "brow_r"}


def test_every_marker_finds_its_mirror_image():
    middle = NEUTRAL[0, 0]
    found = [NAMES[i] if i >= 0 else "" for i in mirrored_markers(NEUTRAL, middle)]
    assert found == ["nose", "brow_r", "brow_l", "corner_r", "corner_l", "chin", ""]


@pytest.mark.parametrize(
    ("side", "read", "signs"),
    [
        ("left", ["brow_l", "corner_l", "odd", "brow_l", "chin"], [-1, 1, 1, 1, 1]),
        ("right", ["brow_r", "corner_r", "odd", "brow_r", "chin"], [1, 1, 1, 1, 1]),
    ],
)
def test_a_half_is_read_by_its_own_markers(side, read, signs):
    variables, found = halved(INPUTS, NAMES, NEUTRAL, ROLES, "nose", side)
    assert [v.role for v in variables] == read
    np.testing.assert_array_equal(found, signs)
    assert [v.name for v in variables] == [v.name for v in INPUTS]


def test_a_face_without_its_nose_tip_is_read_as_it_is():
    variables, signs = halved(INPUTS, NAMES, NEUTRAL, ROLES, "forehead", "left")
    assert [v.role for v in variables] == ["brow_r", "corner_l", "odd", "brow_r", "chin"]
    assert (signs == 1).all()


def test_shapes_belong_to_the_half_that_they_move():
    left, right = sided_shapes(slit_face(), 0.0)
    assert set(left) == {n[: -len("Right")] + "Left" for n in right}
    assert all(name.endswith("Left") for name in left) and len(left) >= 5
    assert "mouthPressLeft" not in left  # it moves two thirds of the lip
