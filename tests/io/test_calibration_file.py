import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from usdface.errors import InputError
from usdface.io.calibration_file import calibration_json, read_calibration_file
from usdface.io.json_fingerprint import is_unedited
from usdface.setup.calibration import Calibration
from usdface.setup.performer_face import PerformerFace


def test_what_was_written_is_read(tmp_path: Path) -> None:
    path = tmp_path / "who.json"
    gains, offsets = np.array([1.25, 0.5]), np.array([0.0, 0.125])
    text = calibration_json(Calibration(("a", "b"), gains, offsets), 0.1 * gains, gains)
    path.write_text(text)
    found = read_calibration_file(path)
    assert found.shapes == ("a", "b")
    assert (found.gains == gains).all() and (found.offsets == offsets).all()
    assert json.loads(text)["shapes"]["a"]["deviation"] == 0.125
    assert is_unedited(json.loads(text))


def test_a_gain_is_enough(tmp_path: Path) -> None:
    path = tmp_path / "who.json"
    comments = '"gains of monday": 0.9, "peak": 1, "offsets": "none seen"'
    path.write_text(f'{{"shapes": {{"smile": {{"gain": 0.8, {comments}}}}}}}')
    found = read_calibration_file(path)
    gains, offsets = found.of(("jaw", "smile"))
    assert gains.tolist() == [1.0, 0.8] and offsets.tolist() == [0.0, 0.0]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "no JSON"),
        ("[]", "expected"),
        ('{"shapes": 3}', "expected"),
        ('{"shapes": {"a": 1.2}}', "'a'"),
        ('{"shapes": {"a": {"gain": "1"}}}', "'a'"),
        ('{"shapes": {"a": {"gian": 1.2, "peak": 1}}}', "'a' has 'gian'; did you mean gain"),
        ('{"shapes": {"a": {"gain": 1.2, "ofset": 0.1}}}', "'a' has 'ofset'; .* offset"),
        ('{"shapes": {"a": {"gain": NaN}}}', "'a'"),
        ('{"shapes": {"a": {"gain": true}}}', "'a'"),
        ('{"shapes": {"a": {"gain": 1.1}, "a": {"gain": 1.5}}}', "'a' occurs twice"),
        ('{"shapes": {"a": {"gain": 2.5}}}', "0.5 to 2"),
        ('{"shapes": {"a": {"gain": -Infinity}}}', "0.5 to 2"),
        (f'{{"shapes": {{"a": {{"gain": 1{400 * "0"}}}}}}}', "0.5 to 2"),
        ('{"shapes": {"a": {"gain": 1, "offset": 0.5}}}', "0 to 0.2"),
    ],
)
def test_what_is_wrong_is_said(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "who.json"
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        read_calibration_file(path)


FACE = PerformerFace(
    ("chin", "lip"),
    [4, 9],
    [[0.0, 0.001, 0.0], [0.0, 0.0, 0.0]],
    [[0.0, 1.0, 2.0], [0.0, 1.1, 2.0]],
    30,
    ("open", "wide"),
    0.001 * np.arange(12).reshape(2, 2, 3),
)


def written(face: PerformerFace) -> str:
    one = np.ones(1)
    return calibration_json(Calibration(("open",), one, 0 * one, face), one, one)


def test_a_face_that_was_written_is_read(tmp_path: Path) -> None:
    path = tmp_path / "who.json"
    path.write_text(written(FACE))
    found = read_calibration_file(path).face
    assert found is not None
    assert (found.markers, found.shapes, found.frames) == (FACE.markers, FACE.shapes, 30)
    for name in ("vertices", "shifts", "rest", "displacements"):
        np.testing.assert_allclose(getattr(found, name), getattr(FACE, name), atol=1e-7)
    assert is_unedited(json.loads(written(FACE)))
    path.write_text('{"shapes": {"a": {}}, "face": null}')
    assert read_calibration_file(path).face is None


@pytest.mark.parametrize(
    ("path_in_file", "value"),
    [
        ((), 3),
        (("markers",), []),
        (("markers", "chin"), 3),
        (("markers", "chin", "point"), -1),
        (("markers", "chin", "point"), 10**30),
        (("markers", "chin", "point"), 1.5),
        (("markers", "chin", "rest"), [0, 1]),
        (("markers", "chin", "rest"), [0, 1, "x"]),
        (("markers", "chin", "rest"), [0, 1, None]),
        (("markers", "chin", "shift"), [[0, 0, 0]]),
        (("markers",), {}),
        (("displacements",), {"open": [[0, 0, 0]]}),
        (("displacements",), {"open": 1}),
        (("displacements",), None),
        (("frames",), "30"),
        (("frames",), -3),
    ],
)
def test_a_face_that_is_wrong_is_said(
    tmp_path: Path, path_in_file: tuple[str, ...], value: object
) -> None:
    document = json.loads(written(FACE))
    place = document
    for key in ("face", *path_in_file)[:-1]:
        place = place[key]
    place[("face", *path_in_file)[-1]] = value
    path = tmp_path / "who.json"
    path.write_text(json.dumps(document))
    with pytest.raises(InputError, match="performer's"):
        read_calibration_file(path)


def test_a_face_that_is_wrong_is_refused_without_assertions_too(tmp_path: Path) -> None:
    document = json.loads(written(FACE))
    next(iter(document["face"]["markers"].values()))["point"] = -3
    path = tmp_path / "who.json"
    path.write_text(json.dumps(document))
    read = (
        "import pathlib, sys, usdface.io.calibration_file as files;"
        "files.read_calibration_file(pathlib.Path(sys.argv[1]))"
    )
    done = subprocess.run(
        [sys.executable, "-O", "-c", read, str(path)], capture_output=True, text=True
    )
    assert "the performer's face is not of the form" in done.stderr
