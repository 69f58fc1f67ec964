"""The dock of usdview, against a stand-in for Qt: what it asks its worker for."""

import importlib
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import pytest
from any_class import AnyClass


@pytest.fixture
def dock(monkeypatch: pytest.MonkeyPatch) -> Any:
    qt = SimpleNamespace(
        QtCore=AnyClass("QtCore"), QtGui=MagicMock(), QtWidgets=AnyClass("QtWidgets")
    )
    monkeypatch.setitem(sys.modules, "pxr.Usdviewq", MagicMock())
    monkeypatch.setitem(sys.modules, "pxr.Usdviewq.qt", qt)
    before = set(sys.modules)
    yield importlib.import_module("usdface_usdview.dock")
    for name in set(sys.modules) - before:
        if name.startswith("usdface_usdview."):
            del sys.modules[name]


def test_a_file_that_was_chosen_is_replaced(dock: Any) -> None:
    asked: list[tuple[str, dict[str, Any]]] = []
    held = SimpleNamespace(
        _shot=lambda: Path("shot.usda"),
        _saved=None,
        panel=SimpleNamespace(gains=lambda: {"joy": 0.5}),
        worker=SimpleNamespace(ask=lambda job, _, **request: asked.append((job, request))),
    )
    dock.Dock.save_to(held, Path("mine.usda"))
    ((job, request),) = asked
    assert job == "process" and request["output"] == "mine.usda" and request["overwrite"] is True
    assert request["gains"] == {"joy": 0.5} and request["again"] is True
