import pytest

from usdface.face.symmetry import gaze_pairs, mirrored_pairs, symmetric_pairs


@pytest.mark.parametrize("left, right", [("Left", "Right"), ("_L", "_R"), ("_left", "_right")])
def test_left_and_right_are_paired_in_any_spelling(left: str, right: str) -> None:
    names = (f"browDown{right}", "jawOpen", f"browDown{left}", f"cheekSquint{left}")
    assert symmetric_pairs(names).tolist() == [[2, 0]]


def test_directions_are_no_pairs() -> None:
    names = ("jawLeft", "jawRight", "mouthLeft", "mouthRight", "eyeLookIn_L", "eyeLookIn_R")
    assert symmetric_pairs((*names, "eyeLookUp_L", "eyeLookUp_R")).tolist() == [[6, 7]]
    assert symmetric_pairs(()).shape == (0, 2)


def test_directions_are_each_others_mirror_image_though_no_face_shows_both() -> None:
    names = ("jawRight", "jawLeft", "smile.l", "smile.r")
    assert mirrored_pairs(names).tolist() == [[1, 0], [2, 3]]
    assert symmetric_pairs(names).tolist() == [[2, 3]]


@pytest.mark.parametrize("eye", ["eyeLook", "EyeLook", "Eye_Look_", "EYE_LOOK_"])
@pytest.mark.parametrize("left, right", [("Left", "Right"), ("_L", "_R")])
def test_both_eyes_turn_to_one_side_up_and_down(left: str, right: str, eye: str) -> None:
    ways = ("Out", "In", "Up", "Down")
    names = tuple(f"{eye}{way}{side}" for side in (left, right) for way in ways)
    assert gaze_pairs(("jawOpen", *names)).tolist() == [[1, 6], [2, 5], [3, 7], [4, 8]]


def test_action_units_of_gaze_are_pairs_by_their_sides() -> None:
    assert gaze_pairs(("AU64_R", "AU64_L", "AU12_L", "AU12_R")).tolist() == [[1, 0]]


def test_shapes_that_turn_both_eyes_or_one_alone_are_no_gaze_pair() -> None:
    assert gaze_pairs(("lookLeft", "lookRight", "lookUp", "aa")).shape == (0, 2)
    assert gaze_pairs(("eyeLookInLeft", "eyeLookInRight", "jawOpen")).shape == (0, 2)


@pytest.mark.parametrize("order", [1, -1])
def test_every_part_of_a_movement_has_its_own_mirror_image(order: int) -> None:
    parts = ("Mouth_Funnel_Up_", "Mouth_Funnel_Down_", "CTRL_expressions_mouthPressU", "eyeWiden")
    names = tuple(f"{part}{side}" for part in parts for side in "LR")[::order]
    pairs = {(names[left], names[right]) for left, right in symmetric_pairs(names).tolist()}
    assert pairs == {(f"{part}L", f"{part}R") for part in parts}


def test_shapes_of_one_name_behind_other_nodes_are_paired_by_their_nodes() -> None:
    names = ("lid_bs.open_L", "lip_bs.open_R", "lip_bs.open_L", "lid_bs.open_R")
    assert sorted(symmetric_pairs(names).tolist()) == [[0, 3], [2, 1]]
