"""The worker of usdview: which files it replaces."""

from pathlib import Path

import pytest
from processed import shoot
from usdface_usdview.worker import process
from worlds import make_world

from usdface.errors import OutputError


def test_a_file_that_was_chosen_is_replaced(tmp_path: Path) -> None:
    shot, chosen = shoot(make_world().write(tmp_path)), tmp_path / "mine.usda"
    chosen.write_text("#usda 1.0\n")
    request = {"shot": str(shot), "output": str(chosen)}
    with pytest.raises(OutputError, match="another origin"):
        process(None, request, lambda *_: None)
    _, answer = process(None, {**request, "overwrite": True}, lambda *_: None)
    assert answer["written"][0] == str(chosen) and "usdface" in chosen.read_text()
