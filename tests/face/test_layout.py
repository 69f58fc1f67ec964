import numpy as np
import pytest
from slits import EXPRESSIONS, slit_face

from usdface.errors import InputError
from usdface.face.layout import FaceLayout, find_layout, split_poses

FACE = slit_face()
PARTS = find_layout(FACE, EXPRESSIONS, 0.0)
POSES = np.array([e.pose(FACE.shape_names) for e in EXPRESSIONS])


def test_the_parts_of_a_pose_add_up_to_it():
    cut = split_poses(POSES, FACE.shape_names, PARTS)
    whole = np.zeros(POSES.shape)
    for row, _, _, part in cut:
        assert part.any() and not (whole[row] * part).any()
        whole[row] += part
    np.testing.assert_array_equal(whole, POSES)


def test_each_part_is_of_one_side_and_one_region():
    kinds = {
        (EXPRESSIONS[row].name, side, region)
        for row, side, region, _ in split_poses(POSES, FACE.shape_names, PARTS)
    }
    assert {k for k in kinds if k[0] == "surprise"} == {
        ("surprise", "both", "mouth"),
        ("surprise", "both", "brows"),
        ("surprise", "left", "eyes"),
        ("surprise", "right", "eyes"),
    }


def test_halves_are_asked_for_where_a_shape_belongs_to_one():
    assert FaceLayout().sides == ("both",)
    assert FaceLayout(right=("b",)).sides == ("both", "left", "right")


def test_without_parts_a_pose_is_one():
    cut = split_poses(POSES, FACE.shape_names, FaceLayout())
    assert [(row, side, region) for row, side, region, _ in cut] == [
        (row, "both", None) for row in range(len(POSES))
    ]


@pytest.mark.parametrize(
    "wrong",
    [
        {"left": ("a", "b"), "right": ("b",)},
        {"regions": {"brows": ("a",), "eyes": ("a",)}},
        {"tolerance": -1.0},
        {"tolerance": np.nan},
    ],
)
def test_what_cannot_be_is_refused(wrong):
    with pytest.raises(InputError):
        FaceLayout(**wrong)
