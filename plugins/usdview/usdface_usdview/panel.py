"""The widgets of the dock: they draw, and say what the user wants."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from pxr.Usdviewq.qt import QtCore, QtWidgets

from usdface_usdview.curves import COLOURS, Curves

__all__ = ["Panel"]

Action = tuple[str, Callable[[], object]]


class Panel(QtWidgets.QWidget):
    """All widgets of the dock.

    Signals
    -------
    layers_changed()
        The boxes of the expression and closure layers.
    residual_changed(bool)
    gains_changed()
    frame_chosen(int)
        A frame index of the take.
    """

    layers_changed = QtCore.Signal()
    residual_changed = QtCore.Signal(bool)
    gains_changed = QtCore.Signal()
    frame_chosen = QtCore.Signal(int)

    def __init__(self, parent: Any = None) -> None:
        super().__init__(parent)
        column = QtWidgets.QVBoxLayout(self)
        row = QtWidgets.QHBoxLayout()
        self.process, self.cancel, self.save = (
            QtWidgets.QPushButton(title) for title in ("Process", "Cancel", "Save ...")
        )
        for button in (self.process, self.cancel, self.save):
            row.addWidget(button)
        column.addLayout(row)
        self.status, self.bar = QtWidgets.QLabel(), QtWidgets.QProgressBar()
        self.status.setWordWrap(True)
        self.bar.setTextVisible(False)
        column.addWidget(self.status)
        column.addWidget(self.bar)
        self.expressions = self._box("Expression layer", True, column)
        self.closure = self._box("Closed eyes and lips", True, column)
        self.residual = self._box("Residual as colour", False, column)
        self.expressions.toggled.connect(lambda _: self.layers_changed.emit())
        self.closure.toggled.connect(lambda _: self.layers_changed.emit())
        self.residual.toggled.connect(self.residual_changed)
        self._rows = QtWidgets.QFormLayout()
        self.sliders: dict[str, Any] = {}
        column.addLayout(self._rows)
        self.curves = Curves(self)
        self.curves.clicked.connect(self.frame_chosen)
        column.addWidget(self.curves)
        self.frames = self._list("Frames to look at", column)
        self.frames.itemClicked.connect(
            lambda item: self.frame_chosen.emit(item.data(QtCore.Qt.UserRole))
        )
        self.warnings = self._list("Warnings (double click: do it)", column)
        self.warnings.setWordWrap(True)
        self.warnings.itemDoubleClicked.connect(self._act)
        self._actions: list[Action | None] = []
        column.addWidget(QtWidgets.QLabel("Why this frame"))
        self.explanation = QtWidgets.QPlainTextEdit()
        self.explanation.setReadOnly(True)
        column.addWidget(self.explanation)
        self.set_busy(False)
        self.set_result(False)

    def gains(self) -> dict[str, float]:
        """Return the gains of the sliders."""
        return {name: slider.value() / 100.0 for name, slider in self.sliders.items()}

    def muted(self) -> list[str]:
        """Return the layers to mute. The closure layer holds the expressions, too."""
        if not self.expressions.isChecked():
            return ["closure", "express"]
        return [] if self.closure.isChecked() else ["closure"]

    def set_busy(self, busy: bool) -> None:
        """Show whether the worker computes."""
        self.bar.setVisible(busy)
        self.cancel.setEnabled(busy)
        self.process.setEnabled(not busy)

    def set_result(self, there: bool) -> None:
        """Show whether there is a result to look at."""
        for each in (self.expressions, self.closure, self.residual, self.save):
            each.setEnabled(there)

    def set_step(self, name: str, fraction: float) -> None:
        """Show the step of the worker; a fraction below 0 is not known."""
        self.bar.setRange(0, 0 if fraction < 0 else 100)
        self.bar.setValue(round(100 * max(fraction, 0)))
        self.status.setText(name)

    def set_gains(self, gains: Mapping[str, float]) -> None:
        """Make a slider for each emotion."""
        while self._rows.rowCount():
            self._rows.removeRow(0)
        self.sliders = {}
        for number, (name, gain) in enumerate(sorted(gains.items())):
            slider = QtWidgets.QSlider(QtCore.Qt.Horizontal)
            slider.setRange(0, 200)
            slider.setValue(round(100 * gain))
            slider.setToolTip("how much of this emotion is shown; 100 % = as designed")
            value = QtWidgets.QLabel(f"{slider.value()} %")
            slider.valueChanged.connect(lambda percent, shown=value: shown.setText(f"{percent} %"))
            slider.valueChanged.connect(lambda _: self.gains_changed.emit())
            row = QtWidgets.QHBoxLayout()
            row.addWidget(slider)
            row.addWidget(value)
            label = QtWidgets.QLabel(name)
            label.setStyleSheet(f"color: {COLOURS[number % len(COLOURS)]}")
            self._rows.addRow(label, row)
            self.sliders[name] = slider

    def set_frames(self, frames: Sequence[Sequence[Any]]) -> None:
        """List the frames to look at, each with its reason."""
        self.frames.clear()
        for frame, why in frames:
            item = QtWidgets.QListWidgetItem(f"frame {frame}: {why}")
            item.setData(QtCore.Qt.UserRole, frame)
            self.frames.addItem(item)

    def clear_warnings(self) -> None:
        """Take all warnings off."""
        self.warnings.clear()
        self._actions = []

    def warn(self, text: str, action: Action | None = None) -> None:
        """Add a warning; a double click calls the function of its action."""
        item = QtWidgets.QListWidgetItem(f"{text}\n  > {action[0]}" if action else text)
        item.setToolTip(text)
        self._actions.append(action)
        self.warnings.addItem(item)

    def _act(self, item: Any) -> None:
        action = self._actions[self.warnings.row(item)]
        if action:
            action[1]()

    def _box(self, title: str, checked: bool, column: Any) -> Any:
        box = QtWidgets.QCheckBox(title)
        box.setChecked(checked)
        column.addWidget(box)
        return box

    def _list(self, title: str, column: Any) -> Any:
        column.addWidget(QtWidgets.QLabel(title))
        listed = QtWidgets.QListWidget()
        listed.setMaximumHeight(110)
        column.addWidget(listed)
        return listed
