"""The glTF export of Blender's extension, against a stand-in for Blender: which command it runs."""

import importlib
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import pytest
from any_class import AnyClass

EXTENSION = Path(__file__).parents[2] / "plugins" / "blender" / "extension"


@pytest.fixture
def export(monkeypatch: pytest.MonkeyPatch) -> Any:
    blender, package = MagicMock(), ModuleType("extension_stand_in")
    blender.types = AnyClass("bpy.types")
    blender.utils.register_classes_factory.return_value = (None, None)
    blender.path.abspath = lambda path: path
    package.__path__ = [str(EXTENSION)]
    monkeypatch.setitem(sys.modules, "bpy", blender)
    monkeypatch.setitem(sys.modules, "bpy.types", blender.types)
    monkeypatch.setitem(sys.modules, "bpy.props", blender.props)
    monkeypatch.setitem(sys.modules, "mathutils", MagicMock())
    monkeypatch.setitem(sys.modules, "mathutils.kdtree", MagicMock())
    monkeypatch.setitem(sys.modules, package.__name__, package)
    yield importlib.import_module(f"{package.__name__}.export_gltf")
    for name in [name for name in sys.modules if name.startswith(f"{package.__name__}.")]:
        del sys.modules[name]


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
