import pytest

from usdface.face.symmetry import mirrored_pairs, symmetric_pairs


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
