"""Stages: what cannot be opened is named with a remedy."""

import os
from pathlib import Path

import pytest

from usdface.errors import InputError
from usdface.io.usd.stage import open_layer, open_stage


@pytest.mark.parametrize(
    "names",
    ["(\n subLayers = [@./solve.usda@]\n)", '\ndef "A" (\n references = @./rig.usda@\n)\n{\n}'],
)
def test_a_file_that_was_left_behind_is_named_with_a_remedy(tmp_path: Path, names: str) -> None:
    """As where a result is moved without its layers, or a shot without its rig."""
    (tmp_path / "shot.usda").write_text(f"#usda 1.0\n{names}\n")
    with pytest.raises(InputError, match=r"Could not .*; move that file there, or make") as raised:
        open_stage(tmp_path / "shot.usda")
    assert "skipping" not in str(raised.value) and raised.value.code == "SCHEMA_BROKEN"
    for name in ("solve", "rig"):  # there, but no layer
        (tmp_path / f"{name}.usda").write_text("#usd 1.0\n")
    with pytest.raises(InputError, match="does not compose") as raised:
        open_stage(tmp_path / "shot.usda")
    assert "move that file" not in str(raised.value)


def _write(path: Path, text: str, second: int) -> None:
    path.write_text(f"#usda 1.0\n{text}")
    os.utime(path, (second, second))


def test_a_file_that_was_corrected_counts_where_something_holds_what_it_was(tmp_path: Path) -> None:
    """As an error in a console holds the stage that it came from."""
    path = tmp_path / "a.usda"
    _write(path, "(subLayers = [@b.usda@])", 1)
    _write(tmp_path / "b.usda", 'def "Old" {}', 1)
    held = open_stage(path)
    _write(tmp_path / "b.usda", '(subLayers = [@c.usda@])\ndef "New" {}', 2)
    _write(tmp_path / "c.usda", 'def "Below" {}', 2)
    stage = open_stage(path)
    names = [prim.GetName() for prim in stage.GetPseudoRoot().GetChildren()]
    assert sorted(names) == ["Below", "New"]
    assert held.GetPrimAtPath("/New")
    assert open_layer(tmp_path / "b.usda").GetPrimAtPath("/New")
    _write(tmp_path / "b.usda", 'def "Newest" {}', 3)
    assert open_layer(tmp_path / "b.usda").GetPrimAtPath("/Newest")


def test_edits_that_are_not_saved_stay(tmp_path: Path) -> None:
    path = tmp_path / "a.usda"
    _write(path, 'def "Old" {}', 1)
    held = open_stage(path)
    held.DefinePrim("/Edited")
    _write(path, 'def "New" {}', 2)
    assert open_stage(path).GetPrimAtPath("/Edited") and held.GetPrimAtPath("/Old")
    assert open_layer(path).GetPrimAtPath("/Edited")
    assert open_layer(path, reread=True).GetPrimAtPath("/New")
