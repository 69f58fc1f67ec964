"""Takes that cannot be read."""

import numpy as np
import pytest
from spoilt import Place, Refused, marker_take, wide_csv


@pytest.mark.parametrize(
    ("rows", "names", "said"),
    [
        ([], "ab", "frames"),
        (["0,,,,,,", "0.1,,,,,,"], "ab", ""),
        (["0,nan,nan,nan,nan,nan,nan"], "ab", ""),
        (["0,1,2,3,4,5,six"], "ab", "six"),
        (["0,1,2,3,4,5,6", "0,1,2,3,4,5,6"], "ab", "increas"),
        (["0,1,2,3,4,5,6"], "aa", "twice"),
    ],
)
def test_a_table_without_a_take(
    place: Place, refused: Refused, rows: list[str], names: str, said: str
) -> None:
    message = refused(["take", wide_csv(place, rows, names), "-o", place / "x.usda"])
    assert "take.csv" in message and said in message


@pytest.mark.parametrize("command", ["shot", "process"])
def test_a_sample_of_another_length(place: Place, refused: Refused, command: str) -> None:
    marker_take(place, "points", [(0, 0, 0)] * 7, 5)
    said = refused(getattr(place, command))
    assert "time code 5" in said and "7" in said and "23" in said and "Take>" in said


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_numbers_that_are_none(place: Place, refused: Refused, value: float) -> None:
    for code in range(40):
        marker_take(place, "points", [(value, 0, 0)] * 23, code)
    assert "finite" in refused(place.process)


def test_every_marker_hidden_in_every_frame(place: Place, refused: Refused) -> None:
    marker_take(place, "usdface:markers:visible", [False] * 23, 0)
    said = refused(place.process)
    assert "visible" in said and "take.trc" in said


def test_two_markers_of_one_name(place: Place, refused: Refused) -> None:
    names = list(place.world.take.names)
    marker_take(place, "usdface:markers:names", [names[0], *names[:-1]])
    said = refused(place.process)
    assert f"'{names[0]}'" in said and "twice" in said


def test_a_take_without_frames(place: Place, refused: Refused) -> None:
    place.edit("take.usda", lambda stage: stage.GetAttributeAtPath("/Take.points").Clear())
    assert "no time samples" in refused(place.process)
