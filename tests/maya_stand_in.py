"""A stand-in for Maya: the base class of chasers, its context, and where messages go.

It is not Maya. Names and behaviour were read in maya-usd (its export chaser and the test of it,
2026-04): a chaser's constructor gets a context, False from one of its functions ends the export.
"""

import sys
from collections.abc import Callable, Mapping
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest
from pxr import Usd

__all__ = ["Maya", "stand_in"]


class Maya:
    """What was said, deferred, loaded and registered; and an export with chasers."""

    def __init__(self) -> None:
        self.errors: list[str] = []
        self.warnings: list[str] = []
        self.messages: list[str] = []
        self.plugins: list[str] = []
        self.deferred: list[Callable[[], object]] = []
        self.chasers: dict[str, Any] = {}
        self.extra: list[str] = []

    def export(self, stage: Usd.Stage, options: Mapping[str, str] | None, **also: Any) -> bool:
        """Run the chaser as an export of three frames does; False = the export was ended."""
        arguments = {"usdface": dict(options)} if options is not None else {}
        context = SimpleNamespace(
            GetStage=lambda: stage,
            GetJobArgs=lambda: SimpleNamespace(allChaserArgs=arguments),
            GetDagToUsdMap=dict,
        )
        chaser = self.chasers["usdface"](context)
        steps = [chaser.ExportDefault, *(lambda t=t: chaser.ExportFrame(t) for t in range(3))]
        for step in (*steps, chaser.PostExport):
            answer = step()
            assert isinstance(answer, bool)
            if not answer:
                return False
        return True


def stand_in(monkeypatch: pytest.MonkeyPatch) -> Maya:
    """Put a stand-in for ``maya`` and ``mayaUsd`` into ``sys.modules``."""
    maya = Maya()

    class ExportChaser:
        def __init__(self, factoryContext: Any, *args: Any, **kwargs: Any) -> None:
            self.made = True

        def RegisterExtraPrimsPaths(self, paths: list[str]) -> None:
            assert self.made, "the constructor of the base class was not called"
            maya.extra += paths

        @staticmethod
        def Register(kind: Any, name: str) -> None:
            maya.chasers[name] = kind

    modules = {name: ModuleType(name) for name in ("maya", "maya.api", "maya.api.OpenMaya")}
    modules |= {name: ModuleType(name) for name in ("maya.cmds", "mayaUsd", "mayaUsd.lib")}
    modules["mayaUsd.lib"].ExportChaser = ExportChaser  # type: ignore[attr-defined]
    modules["mayaUsd"].lib = modules["mayaUsd.lib"]  # type: ignore[attr-defined]
    modules["maya.api.OpenMaya"].MGlobal = SimpleNamespace(  # type: ignore[attr-defined]
        displayError=maya.errors.append,
        displayWarning=maya.warnings.append,
        displayInfo=maya.messages.append,
    )
    commands = modules["maya.cmds"]
    commands.loadPlugin = lambda name, quiet=False: maya.plugins.append(name)  # type: ignore[attr-defined]
    commands.evalDeferred = maya.deferred.append  # type: ignore[attr-defined]
    modules["maya"].cmds = commands  # type: ignore[attr-defined]
    for name, module in modules.items():
        monkeypatch.setitem(sys.modules, name, module)
    for name in [n for n in sys.modules if n == "userSetup" or n.startswith("usdface_maya.chaser")]:
        monkeypatch.delitem(sys.modules, name)
    return maya
