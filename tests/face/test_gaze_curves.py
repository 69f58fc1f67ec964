import csv
from pathlib import Path

import numpy as np
import pytest

from usdface.face.gaze_curves import gaze_angles, gaze_curves_of, gaze_shapes_of

NAMES = tuple(f"eyeLook{way}{side}" for side in ("Left", "Right") for way in ("In", "Out", "Up"))


def test_eyes_that_look_to_the_left_look_there_both() -> None:
    weights = np.zeros((1, len(NAMES)))
    weights[0, [NAMES.index("eyeLookOutLeft"), NAMES.index("eyeLookInRight")]] = 1.0
    angles = gaze_angles(NAMES, weights)
    assert angles["left"][0, 0] > 0.5 and angles["right"][0, 0] > 0.5
    assert angles["left"][0, 1] == angles["right"][0, 1] == 0.0


def test_up_is_positive_and_only_eyes_with_curves_are_there() -> None:
    names = ("jawOpen", "eyeLookUp_L", "EyeLookDownLeft")
    angles = gaze_angles(names, np.array([[1.0, 0.5, 0.0], [1.0, 0.0, 0.5]]))
    assert set(angles) == {"left"}
    assert angles["left"][0, 1] > 0.2 and angles["left"][1, 1] < -0.2


def test_gaze_is_told_by_its_names() -> None:
    names = ("EyeLookInLeft", "eyeLookDown_R", "eyeBlinkLeft", "lookLeft")
    assert gaze_curves_of(names) == set(names[:2])
    assert gaze_shapes_of(names) == {*names[:2], "lookLeft"}


def test_the_angles_are_those_that_a_phone_records(shared_data: Path) -> None:
    """Its eyes' yaw is positive to the face's own right, pitch down, and starts at a vergence."""
    (path,) = (shared_data / "livelinkface").glob("*.csv")
    header, *rows = csv.reader(path.read_text().splitlines())
    table = np.array([row[2:] for row in rows if len(row) == len(header)], dtype=float)
    column = {name.lower(): values for name, values in zip(header[2:], table.T, strict=True)}
    names = tuple(name for name in header[2:] if name in gaze_curves_of(header[2:]))
    angles = gaze_angles(names, np.stack([column[name.lower()] for name in names], axis=1))
    for side, ours in angles.items():
        for axis, name in enumerate(("yaw", "pitch")):
            recorded = -column[f"{side}eye{name}"]
            difference = ours[:, axis] - recorded
            assert np.degrees(np.std(difference)) < 0.6
            assert np.degrees(np.abs(difference).max()) < (6.0 if axis == 0 else 2.0)


@pytest.mark.parametrize("name", ["eyeLookIn", "eyeLook", "lookInLeft"])
def test_curves_without_a_side_or_a_direction_are_none(name: str) -> None:
    assert not gaze_angles((name,), np.ones((1, 1)))
