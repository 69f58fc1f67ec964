"""`usdface formats`, and the lists in help texts."""

import json

import pytest

from usdface.cli import main
from usdface.io.export_targets import EXPORT_TARGETS
from usdface.io.format_table import FormatTable
from usdface.io.rigs.formats import RIG_READERS
from usdface.io.takes.formats import TAKE_READERS


def test_the_formats_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["formats", "--format", "json"]) == 0
    listed = json.loads(capsys.readouterr().out)
    assert {"name": "C3D", "suffixes": [".c3d"], "origin": "usdface"} in listed["takes"]
    assert [each["name"] for each in listed["exports"]] == ["glTF", "USDZ"]
    assert main(["formats"]) == 0
    text = capsys.readouterr().out
    assert "take: C3D" in text and "rig: folder of OBJ or PLY" in text and ".usdz" in text


@pytest.mark.parametrize(
    ("command", "table"), [("take", TAKE_READERS), ("rig", RIG_READERS), ("export", EXPORT_TARGETS)]
)
def test_help_lists_the_table(
    command: str,
    table: FormatTable,  # type: ignore[type-arg]
    capsys: pytest.CaptureFixture[str],
) -> None:
    with pytest.raises(SystemExit):
        main([command, "--help"])
    assert table.summary in " ".join(capsys.readouterr().out.split())
