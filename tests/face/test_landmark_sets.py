import numpy as np
import pytest

from usdface.face.landmark_sets import landmark_places, nose_tip_landmark
from usdface.face.marker_name_places import LANDMARKS, named_places

IBUG = tuple(f"landmark_{number}" for number in range(68))
MEDIAPIPE = tuple(f"landmark_{number}" for number in range(478))
# Right for left along each chain of iBUG's figure: jaw, brows, nostrils, eyes, lips.
MIRRORED = np.array(
    [
        *range(16, -1, -1),
        *range(26, 16, -1),
        *(27, 28, 29, 30, 35, 34, 33, 32, 31),
        *(45, 44, 43, 42, 47, 46, 39, 38, 37, 36, 41, 40),
        *(54, 53, 52, 51, 50, 49, 48, 59, 58, 57, 56, 55),
        *(64, 63, 62, 61, 60, 67, 66, 65),
    ]
)


def test_landmarks_of_ibug_are_mirrored_and_where_anatomy_has_them() -> None:
    places = landmark_places(IBUG)
    assert places is not None
    for own, other in zip(places, (places[number] for number in MIRRORED), strict=True):
        assert (own is None) == (other is None)
        if own and other:
            assert (own.part, own.x, own.y) == (other.part, -other.x, other.y)
    for number, landmark in {45: "eye outer", 42: "eye inner", 54: "mouth corner"}.items():
        place = places[number]
        assert place and (place.x, place.y) == LANDMARKS[landmark]
    assert [number for number, place in enumerate(places) if place is None] == [
        *(0, 1, 2),
        *(14, 15, 16),
    ]


def test_landmarks_of_mediapipe_that_rigs_share_have_a_place() -> None:
    places = landmark_places(MEDIAPIPE)
    assert places is not None
    assert sum(place is not None for place in places) == 75
    right, left, chin = places[33], places[263], places[152]
    assert right and left and chin
    assert (right.x, left.x, chin.y) == (-46, 46, -116)  # the performer's right eye is at the left
    assert places[468] is None  # an iris


@pytest.mark.parametrize(
    "names",
    [
        [f"m{number}" for number in range(68)],
        [f"landmark_{number}" for number in range(30)],
        [f"landmark_{number}" for number in range(500)],
        [*IBUG, "chin"],
        [*IBUG[:60], *(f"{name}:{name}" for name in IBUG[:5])],
        [],
    ],
)
def test_numbers_of_other_sets_are_no_landmarks(names: list[str]) -> None:
    assert landmark_places(names) is None
    assert nose_tip_landmark(names) == ""


def test_names_of_landmarks_are_places_as_words_are() -> None:
    place = named_places([f"openface:{name}" for name in IBUG])[48]
    assert place is not None
    assert (place.part, place.side, place.description) == ("mouth", -1, "right mouth")
    assert nose_tip_landmark(MEDIAPIPE) == "landmark_1"


@pytest.mark.parametrize("form", ["Take01_landmark_{}", "actor landmark{}_v2", "cam-2 lmk.{}"])
def test_words_around_the_numbers_do_not_count_if_all_have_them(form: str) -> None:
    plain = landmark_places([f"landmark_{number}" for number in range(68)])
    names = [form.format(number) for number in range(68)]
    assert landmark_places(names) == plain
    assert nose_tip_landmark(names) == names[30]
    assert landmark_places([f"other_{names[0]}", *names[1:]]) is None
