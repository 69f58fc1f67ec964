"""Modules of Blender's extension, imported with a stand-in for Blender."""

import importlib
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any
from unittest.mock import MagicMock

import pytest
from any_class import AnyClass

__all__ = ["extension_parts"]

EXTENSION = Path(__file__).parents[1] / "plugins" / "blender" / "extension"
NAME = "extension_stand_in"


@contextmanager
def extension_parts(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[str], Any]]:
    """Yield a function that imports a module of the extension by its name."""
    blender, package = MagicMock(), ModuleType(NAME)
    blender.types = AnyClass("bpy.types")
    blender.utils.register_classes_factory.return_value = (None, None)
    package.__path__ = [str(EXTENSION)]
    monkeypatch.setitem(sys.modules, "bpy", blender)
    monkeypatch.setitem(sys.modules, "bpy.types", blender.types)
    monkeypatch.setitem(sys.modules, "bpy.props", blender.props)
    monkeypatch.setitem(sys.modules, "mathutils", MagicMock())
    monkeypatch.setitem(sys.modules, "mathutils.kdtree", MagicMock())
    monkeypatch.setitem(sys.modules, NAME, package)
    yield lambda part: importlib.import_module(f"{NAME}.{part}")
    for name in [name for name in sys.modules if name.startswith(f"{NAME}.")]:
        del sys.modules[name]
