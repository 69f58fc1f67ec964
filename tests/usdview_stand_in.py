"""A stand-in for usdview: its plug-in interface, its window, its data model. It is not usdview.

Registries carry no ``pxr.Usdviewq``. The stand-in has the names of `USED` and no others, so that a
plug-in that calls anything else fails here; that usdview has those names was read in its sources
(the same in all versions listed).
"""

import importlib
import sys
from collections.abc import Callable
from types import ModuleType, SimpleNamespace
from typing import Any

from pxr import Tf, Usd

__all__ = ["READ_IN", "USED", "Registry", "Usdview", "install_stand_in", "load_containers"]

# pxr/usdImaging/usdviewq of OpenUSD, in these versions
READ_IN = ("22.11", "23.02", "23.11", "24.05", "24.08", "24.11rc1")
USED = {
    "plugin.py": {
        "PluginContainer": ("configureView", "deferredImport", "registerPlugins"),
        "PluginRegistry": ("registerCommandPlugin",),
        "PluginUIBuilder": ("findOrCreateMenu",),
        "PluginMenu": ("addItem",),
        "CommandPlugin": ("displayName", "name", "run"),
    },
    "usdviewApi.py": {
        "UsdviewApi": (
            "GrabViewportShot",
            "PrintStatus",
            "UpdateViewport",
            "dataModel",
            "frame",
            "qMainWindow",
            "stage",
        )
    },
    "rootDataModel.py": {"RootDataModel": ("playing", "signalStageReplaced")},
    "qt.py": {"": ("QtCore", "QtGui", "QtWidgets")},
    "mainWindowUI.ui": {"QLineEdit": ("frameField",)},
}


def install_stand_in(qt: bool = True) -> None:
    """Put a stand-in for ``pxr.Usdviewq`` into ``sys.modules``; without Qt for what needs none."""
    package = ModuleType("pxr.Usdviewq")
    package.__path__ = []  # type: ignore[attr-defined]
    plugin = ModuleType("pxr.Usdviewq.plugin")
    container = type("PluginContainer", (_Container,), {"__module__": "pxr.Usdviewq.plugin"})
    plugin.PluginContainer = container  # type: ignore[attr-defined]
    sys.modules |= {"pxr.Usdviewq": package, "pxr.Usdviewq.plugin": plugin}
    package.plugin = plugin  # type: ignore[attr-defined]
    if not Tf.Type.FindByName("pxr.Usdviewq.plugin.PluginContainer").pythonClass:
        Tf.Type.Define(container)
    if qt:
        from PySide6 import QtCore, QtGui, QtWidgets

        given = ModuleType("pxr.Usdviewq.qt")
        given.QtCore, given.QtGui, given.QtWidgets = QtCore, QtGui, QtWidgets  # type: ignore[attr-defined]
        sys.modules["pxr.Usdviewq.qt"] = given


class _Deferred:
    """Functions of a module that is imported when the first of them is called."""

    def __init__(self, module: str, package: str) -> None:
        self._where = module, package

    def __getattr__(self, name: str) -> Callable[..., Any]:
        def call(*arguments: Any) -> Any:
            return getattr(importlib.import_module(*self._where), name)(*arguments)

        return call


class _Container:
    """A base class of containers; both functions are a plug-in's."""

    def deferredImport(self, module: str) -> _Deferred:
        # As usdview does: a relative name is one below the module of the container
        return _Deferred(module, self.__module__)


class Registry:
    """Commands by name; callbacks get the API."""

    def __init__(self, usdview: Any) -> None:
        self._usdview = usdview
        self.commands: dict[str, SimpleNamespace] = {}

    def registerCommandPlugin(
        self, name: str, title: str, callback: Callable[[Any], object], description: str = ""
    ) -> SimpleNamespace:
        assert name not in self.commands
        command = SimpleNamespace(
            name=name,
            displayName=title,
            description=description,
            run=lambda: callback(self._usdview),
        )
        self.commands[name] = command
        return command


class _Menu:
    def __init__(self, menu: Any) -> None:
        self._menu = menu
        self.items: list[str] = []

    def addItem(self, command: Any, shortcut: Any = None) -> Any:
        self.items.append(command.displayName)
        return self._menu.addAction(command.displayName, command.run) if self._menu else None


class _Builder:
    def __init__(self, window: Any = None) -> None:
        self._window = window
        self.menus: dict[str, _Menu] = {}

    def findOrCreateMenu(self, name: str) -> _Menu:
        bar = self._window.menuBar() if self._window else None
        return self.menus.setdefault(name, _Menu(bar.addMenu(name) if bar else None))


def load_containers(usdview: Any, window: Any = None) -> tuple[Registry, _Builder]:
    """Find, load and register all containers on PXR_PLUGINPATH_NAME, by Plug and Tf."""
    from pxr import Plug

    base = Tf.Type.FindByName("pxr.Usdviewq.plugin.PluginContainer")
    registry, builder = Registry(usdview), _Builder(window)
    for kind in Plug.Registry.GetAllDerivedTypes(base):
        Plug.Registry().GetPluginForType(kind).Load()
        assert kind.pythonClass is not None, kind.typeName
        container = kind.pythonClass()
        container.registerPlugins(registry, usdview)
        container.configureView(registry, builder)
    return registry, builder


class Usdview:
    """A window with a frame field, and the API on a stage: what `USED` names, and `drawn`.

    Parameters
    ----------
    stage : Usd.Stage
    """

    def __init__(self, stage: Usd.Stage) -> None:
        from PySide6 import QtCore, QtWidgets

        class Model(QtCore.QObject):  # type: ignore[misc]
            signalStageReplaced = QtCore.Signal()
            playing = False

        self.dataModel = Model()
        self.qMainWindow = QtWidgets.QMainWindow()
        self.stage: Usd.Stage | None = stage
        self.frame = Usd.TimeCode(stage.GetStartTimeCode())
        self.drawn = self.scheduled = 0
        self.said: list[str] = []
        field = QtWidgets.QLineEdit(self.qMainWindow)
        field.setObjectName("frameField")
        field.hide()
        field.editingFinished.connect(lambda: self.set_frame(float(field.text())))

    def set_frame(self, code: float) -> None:
        self.frame = Usd.TimeCode(code)

    def GrabViewportShot(self) -> None:
        self.drawn += 1

    def UpdateViewport(self) -> None:
        self.scheduled += 1

    def PrintStatus(self, message: str) -> None:
        self.said.append(message)
