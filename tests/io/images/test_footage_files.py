from pathlib import Path

import pytest

from usdface.errors import InputError
from usdface.io.images.footage_files import read_confidence, read_named_places


@pytest.mark.parametrize("text", ["3", "[]", "{}", '{"details": []}', '{"details": null}'])
def test_what_is_no_report_of_a_take_is_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "take.json"
    path.write_text(text)
    with pytest.raises(InputError, match="has no dots"):
        read_confidence(path, 1)


@pytest.mark.parametrize("number", ["9" * 400, "1e400", "null", "true", '"left"'])
def test_a_place_that_is_no_number_is_refused(tmp_path: Path, number: str) -> None:
    path = tmp_path / "names.json"
    path.write_text(f'[{{"name": "chin", "x": {number}, "y": 1}}]')
    with pytest.raises(InputError, match=r"x of 'chin' is .*; expected a number"):
        read_named_places(path)
