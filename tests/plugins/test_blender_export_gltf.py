"""The glTF export of Blender's extension, against a stand-in for Blender: which command it runs."""

import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from blender_stand_in import extension_parts


@pytest.fixture
def export(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    with extension_parts(monkeypatch) as part:
        sys.modules["bpy"].path.abspath = lambda path: path
        yield part("export_gltf")


@pytest.mark.parametrize("chosen", ["face.glb", ""])
def test_only_a_file_that_was_chosen_is_replaced(export: Any, tmp_path: Path, chosen: str) -> None:
    result = tmp_path / "shot.usdface.usda"
    result.touch()
    operator = export.USDFACE_OT_export_gltf()
    operator.filepath = str(tmp_path / chosen) if chosen else ""
    scene = SimpleNamespace(usdface=SimpleNamespace(result=str(result)))
    (command,) = operator.prepare(SimpleNamespace(scene=scene))
    assert command.words[:4] == (
        "export",
        str(result),
        "-o",
        str(tmp_path / (chosen or "shot.usdface.glb")),
    )
    assert ("--overwrite" in command.words) == bool(chosen)
