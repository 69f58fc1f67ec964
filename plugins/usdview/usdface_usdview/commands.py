"""The commands of the menu: each acts on the one dock, which is made when it is first wanted."""

from typing import Any

from pxr.Usdviewq.qt import QtCore

from usdface_usdview.dock import Dock

__all__ = ["process", "save", "show_panel", "toggle_expressions"]


def show_panel(usdview: Any) -> None:
    """Show the dock."""
    _dock(usdview).show()


def process(usdview: Any) -> None:
    """Process the shot that is open."""
    dock = _dock(usdview)
    dock.show()
    dock.process()


def toggle_expressions(usdview: Any) -> None:
    """Mute or unmute the expression layer."""
    dock = _dock(usdview)
    dock.panel.expressions.setChecked(not dock.panel.expressions.isChecked())


def save(usdview: Any) -> None:
    """Write the result as files."""
    _dock(usdview).save()


def _dock(usdview: Any) -> Dock:
    window = usdview.qMainWindow
    dock = window.findChild(Dock)
    if dock is None:
        dock = Dock(usdview, window)
        window.addDockWidget(QtCore.Qt.RightDockWidgetArea, dock)
    return dock
