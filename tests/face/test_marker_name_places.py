import numpy as np
import pytest
from marker_sets import MARKER_SETS, renamed

from usdface.face.marker_name_places import NamedPlace, named_places
from usdface.face.place_vocabulary import PARTS, WORDS
from usdface.takes import MarkerTake

ANIMFACE = (
    *("ForeHead_M", "ForeHead_L", "Leyebrow_M", "Reyebrow_Inside", "Eyebrow_Center", "NoseTop"),
    *("NoseHead", "NoseHead_R", "Leye_Up", "Reye_Outside", "Lcheek_Down", "Rcheek_up", "Mouth_Up"),
    *("Mouth_UpR1", "Mouth_Lend", "Mouth_DownL", "Chin", "Chin_R2"),
)


def named_place(name: str) -> NamedPlace | None:
    return named_places((name,))[0]


@pytest.mark.parametrize(
    "name", ["", "m12", "Marker_003", "C7", "LKNE", "RBHD", "elbow", "unlabeled 7", "T10", "*12"]
)
def test_other_names_tell_no_place(name: str) -> None:
    assert named_place(name) is None


@pytest.mark.parametrize(
    ("behind", "words"),
    [
        ("OBRO", "outer brow"),
        ("MBRO", "middle brow"),
        ("IBRO", "inner brow"),
        ("BRO", "brow"),
        ("ULID", "upper lid"),
        ("LLID", "lower lid"),
        ("LIP", "lip"),
        ("OEYE", "outer eye"),
        ("CHEEK", "cheek"),
        ("MOUTH", "mouth"),
        ("FHD", "forehead"),
        ("NSTRL", "nostril"),
        ("C1", "cheek"),
        ("Brow_Outer", "brow outer"),
        ("MC", "mouth corner"),
    ],
)
def test_a_first_letter_is_a_side_where_there_is_the_other(behind: str, words: str) -> None:
    for letter, other, side in (("L", "R", "left"), ("R", "L", "right")):
        pair = named_places((letter + behind, f"actor:{other}{behind}"))
        assert pair[0] == named_place(f"{side} {words}") and pair[1] is not None
        assert pair[0] is not None and pair[0].side == -pair[1].side


def test_no_other_side_no_letter_of_one() -> None:
    upper, lower = named_places(("ULip", "LLip"))
    assert upper is not None and lower is not None and lower.side == 0
    assert [place and place.side for place in named_places(("LLip", "RLip"))] == [1, -1]
    assert named_places(("LKNE", "RKNE", "LBHD", "RBHD")) == (None,) * 4


def test_case_separators_and_numbers_change_nothing() -> None:
    for name in ("left_brow_outer", "LEFT_BROW_OUTER", "LeftBrowOuter", "left.brow.outer.3"):
        assert named_place(name) == named_place("left brow outer")


def test_left_is_the_mirror_image_of_right() -> None:
    for part in PARTS:
        for direction in ("", "upper", "lower", "inner", "outer", "corner", "middle"):
            left, right = (named_place(f"{side} {part} {direction}") for side in ("left", "right"))
            assert left is not None and right is not None
            np.testing.assert_allclose(np.multiply(left.places, (-1, 1)), right.places)
            assert (left.part, left.side, left.spread) == (right.part, -right.side, right.spread)


def test_directions_lead_where_they_say_and_narrow() -> None:
    for part in ("brow", "lid", "eye", "cheek", "lip", "mouth", "forehead"):
        plain = named_place(f"left {part}")
        assert plain is not None
        (x, y), *_ = plain.places
        for word, axis, sign in (
            *(("upper", 1, 1), ("lower", 1, -1), ("inner", 0, -1), ("outer", 0, 1)),
        ):
            named = named_place(f"left {part} {word}")
            assert named is not None and named.spread < plain.spread
            assert sign * (named.places[0][axis] - (x, y)[axis]) > 0


def test_every_part_is_found_by_each_of_its_words() -> None:
    for word, concepts in WORDS.items():
        for part in set(concepts) & set(PARTS):
            place = named_place(f"left_{word}")
            assert place is not None and (place.part == part or part in ("lip", "mouth"))


def test_names_without_a_side_are_in_the_middle_where_others_have_one() -> None:
    chin, left, right = named_places(("chin", "chin_l", "chin_r"))
    assert chin is not None and len(chin.places) == 1 and chin.places[0][0] == 0
    assert left is not None and right is not None
    # Of several that only a number distinguishes nobody knows.
    first, second, *_ = named_places(("chin1", "chin2", "brow_l", "brow_r"))
    assert first == second is not None and len(first.places) == 3


def test_other_marker_sets_say_the_same() -> None:
    times = np.arange(2.0)
    take = MarkerTake(ANIMFACE, times, np.zeros((2, len(ANIMFACE), 3)), 60.0)
    result = dict(zip(ANIMFACE, named_places(ANIMFACE), strict=True))
    for marker_set in sorted(set(MARKER_SETS) - {"anonymous", "exchanged"}):
        for name, place in zip(
            ANIMFACE, named_places(renamed(take, marker_set).names), strict=True
        ):
            own = result[name]
            assert place is not None and own is not None
            apart = np.linalg.norm(np.subtract(place.places, own.places[0]), axis=1).min()
            assert apart < 3 * max(place.spread, own.spread), (marker_set, name)


def test_exchanged_names_are_of_the_other_side() -> None:
    take = MarkerTake(ANIMFACE, np.arange(2.0), np.zeros((2, len(ANIMFACE), 3)), 60.0)
    for own, other in zip(
        named_places(ANIMFACE), named_places(renamed(take, "exchanged").names), strict=True
    ):
        assert own is not None and other is not None and own.side == -other.side


@pytest.mark.parametrize(
    "form", ["Take01_{}", "actor3-{}", "{}_v2", "M_{}", "C_{}", "L2 {}", "head.{}", "mk_{}_geo"]
)
def test_words_that_all_markers_have_are_no_places(form: str) -> None:
    names = ("LOBRO", "ROBRO", "chin", "nose", "LMouthCorner", "RMouthCorner", "UpLip", "C1")
    assert named_places([form.format(name) for name in names]) == named_places(names)


def test_a_part_that_all_markers_have_is_theirs() -> None:
    names = ("mouth_L", "mouth_R", "mouth_up", "mouth_low")
    assert [place.part for place in named_places(names) if place] == ["mouth"] * 4
    left = named_places(("L_brow", "L_cheek", "L_chin"))
    assert [place.side for place in left if place] == [1, 1, 1]
