"""Stages: what cannot be opened is named with a remedy."""

from pathlib import Path

import pytest

from usdface.errors import InputError
from usdface.io.usd.stage import open_stage


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
