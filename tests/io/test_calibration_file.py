import json
from pathlib import Path

import numpy as np
import pytest

from usdface.errors import InputError
from usdface.io.calibration_file import calibration_json, read_calibration_file
from usdface.retarget_setup import Calibration


def test_what_was_written_is_read(tmp_path: Path) -> None:
    path = tmp_path / "who.json"
    gains, offsets = np.array([1.25, 0.5]), np.array([0.0, 0.125])
    text = calibration_json(Calibration(("a", "b"), gains, offsets), 0.1 * gains, gains)
    path.write_text(text)
    found = read_calibration_file(path)
    assert found.shapes == ("a", "b")
    assert (found.amplitudes == gains).all() and (found.offsets == offsets).all()
    assert json.loads(text)["shapes"]["a"]["deviation"] == 0.125


def test_a_gain_is_enough(tmp_path: Path) -> None:
    path = tmp_path / "who.json"
    path.write_text('{"shapes": {"smile": {"gain": 0.8}}}')
    found = read_calibration_file(path)
    gains, offsets = found.of(("jaw", "smile"))
    assert gains.tolist() == [1.0, 0.8] and offsets.tolist() == [0.0, 0.0]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{", "no JSON"),
        ("[]", "expected"),
        ('{"shapes": 3}', "expected"),
        ('{"shapes": {"a": 1.2}}', "'a'"),
        ('{"shapes": {"a": {"gain": "1"}}}', "'a'"),
        ('{"shapes": {"a": {"gain": NaN}}}', "'a'"),
        ('{"shapes": {"a": {"gain": 2.5}}}', "0.5 to 2"),
        ('{"shapes": {"a": {"gain": -Infinity}}}', "0.5 to 2"),
        ('{"shapes": {"a": {"gain": 1, "offset": 0.5}}}', "0 to 0.2"),
    ],
)
def test_what_is_wrong_is_said(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "who.json"
    path.write_text(text)
    with pytest.raises(InputError, match=said):
        read_calibration_file(path)
