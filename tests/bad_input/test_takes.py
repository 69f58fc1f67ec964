"""Takes that cannot be read."""

import numpy as np
import pytest
from pxr import Sdf, Usd
from spoilt import Place, Refused, marker_take, wide_csv


@pytest.mark.parametrize(
    ("rows", "names", "expected"),
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
    place: Place, refused: Refused, rows: list[str], names: str, expected: str
) -> None:
    message = refused(["take", wide_csv(place, rows, names), "-o", place / "x.usda"])
    assert "take.csv" in message and expected in message


@pytest.mark.parametrize("command", ["shot", "process"])
def test_a_sample_of_another_length(place: Place, refused: Refused, command: str) -> None:
    marker_take(place, "points", [(0, 0, 0)] * 7, 5)
    message = refused(getattr(place, command))
    assert "time code 5" in message and "7" in message and "23" in message and "Take>" in message


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_numbers_that_are_none(place: Place, refused: Refused, value: float) -> None:
    for code in range(40):
        marker_take(place, "points", [(value, 0, 0)] * 23, code)
    assert "finite" in refused(place.process)


def test_every_marker_hidden_in_every_frame(place: Place, refused: Refused) -> None:
    marker_take(place, "usdface:markers:visible", [False] * 23, 0)
    message = refused(place.process)
    assert "visible" in message and "take.trc" in message


def test_two_markers_of_one_name(place: Place, refused: Refused) -> None:
    names = list(place.world.take.names)
    marker_take(place, "usdface:markers:names", [names[0], *names[:-1]])
    message = refused(place.process)
    assert f"'{names[0]}'" in message and "twice" in message


def test_a_take_without_frames(place: Place, refused: Refused) -> None:
    place.edit("take.usda", lambda stage: stage.GetAttributeAtPath("/Take.points").Clear())
    assert "no time samples" in refused(place.process)


def sized(place: Place, name: str, kind: Sdf.ValueTypeName, value: object) -> None:
    """Author an attribute of the take's markers that it does not have."""

    def change(stage: Usd.Stage) -> None:
        take = stage.GetRootLayer().GetPrimAtPath("/Take")
        Sdf.AttributeSpec(take, f"usdface:markers:{name}", kind).default = value

    place.edit("take.usda", change)


@pytest.mark.parametrize(
    ("diameter", "expected"),
    [
        (-0.01, "positive"),
        (0, "positive"),
        (np.inf, "positive"),
        (1e300, "positive"),
        (5, "'nose'"),
    ],
)
def test_dots_of_no_size(place: Place, refused: Refused, diameter: float, expected: str) -> None:
    sized(place, "diameters", Sdf.ValueTypeNames.DoubleArray, [diameter] * 23)
    message = refused(place.process)
    assert "diameter" in message and expected in message


def test_dots_of_other_markers(place: Place, refused: Refused) -> None:
    sized(place, "diameters", Sdf.ValueTypeNames.DoubleArray, [0.004] * 22)
    assert "22 diameters for 23 markers" in refused(place.process)


@pytest.mark.parametrize("deviation", [-0.1, np.nan, np.inf, 1e300, 50.0])
def test_a_deviation_that_is_none(place: Place, refused: Refused, deviation: float) -> None:
    sized(place, "deviation", Sdf.ValueTypeNames.Double, deviation)
    assert "deviation of the markers" in refused(place.process)


@pytest.mark.parametrize("name", ["diameters", "deviation"])
def test_a_size_that_is_a_word(place: Place, refused: Refused, name: str) -> None:
    sized(place, name, Sdf.ValueTypeNames.String, "six")
    assert "Take>" in refused(place.process)


@pytest.mark.parametrize(
    ("takes", "options", "said"),
    [
        (1, ["--cameras", "stereo.yml"], "take.csv is the take of one camera"),
        (2, [], "2 takes and no calibration of cameras"),
    ],
)
def test_takes_that_do_not_go_with_the_cameras(
    place: Place, refused: Refused, takes: int, options: list[str], said: str
) -> None:
    (place / "stereo.yml").write_text("%YAML:1.0\n")
    take = wide_csv(place, ["0,1,2,3,4,5,6"], "ab")
    options = [str(place / o) if o.endswith(".yml") else o for o in options]
    assert said in refused(["take", *[take] * takes, *options, "-o", place / "x.usda"])
