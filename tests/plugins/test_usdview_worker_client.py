"""The client of usdview's worker, against a stand-in for Qt: what does not start is said."""

import importlib
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

PLUGIN = Path(__file__).parents[2] / "plugins" / "usdview"


class Signal:
    """A signal of one object, which remembers what was emitted."""

    def __init__(self, *_: type) -> None:
        self.said: list[tuple[Any, ...]] = []
        self.slots: list[Callable[..., object]] = []

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = f"_{name}_signal"

    def __get__(self, held: Any, owner: type) -> "Signal":
        return held.__dict__.setdefault(self.name, Signal())

    def connect(self, slot: Callable[..., object]) -> None:
        self.slots.append(slot)

    def emit(self, *values: Any) -> None:
        self.said.append(values)
        for slot in self.slots:
            slot(*values)


class Process:
    """A QProcess that fails at once, as Qt's does without a program, and on Windows."""

    FailedToStart, ForwardedErrorChannel = 0, 4

    def __init__(self, parent: Any) -> None:
        self.readyReadStandardOutput, self.finished = Signal(), Signal()
        self.errorOccurred = Signal()

    def setProcessChannelMode(self, _: int) -> None: ...

    def setProcessEnvironment(self, _: Any) -> None: ...

    def start(self, program: str, words: list[str]) -> None:
        self.errorOccurred.emit(self.FailedToStart)

    def write(self, _: bytes) -> None:
        raise AssertionError("a process that does not run is written to")


@pytest.fixture
def client(monkeypatch: pytest.MonkeyPatch) -> Any:
    class Object:
        def __init__(self, parent: Any = None) -> None: ...

    environment = SimpleNamespace(systemEnvironment=lambda: SimpleNamespace(insert=lambda *_: None))
    qt = ModuleType("pxr.Usdviewq.qt")
    qt.QtCore = SimpleNamespace(
        QObject=Object, Signal=Signal, QProcess=Process, QProcessEnvironment=environment
    )
    monkeypatch.setitem(sys.modules, "pxr.Usdviewq", ModuleType("pxr.Usdviewq"))
    monkeypatch.setitem(sys.modules, "pxr.Usdviewq.qt", qt)
    monkeypatch.syspath_prepend(str(PLUGIN))
    name = "usdface_usdview.worker_client"
    monkeypatch.delitem(sys.modules, name, raising=False)
    made = importlib.import_module(name).WorkerClient()
    monkeypatch.delitem(sys.modules, name)
    return made


def test_a_worker_that_does_not_start_is_said_and_nothing_stays_busy(client: Any) -> None:
    client.ask("process", lambda result: None, shot="shot.usda")
    assert [code for _, code in client.failed.said] == ["WORKER_ENDED"]
    assert client.busy.said[-1] == (False,) and not client.running
