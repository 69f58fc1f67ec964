"""Curves over the frames of the take, with a play head: draws, and says where was clicked."""

from collections.abc import Mapping, Sequence
from typing import Any

from pxr.Usdviewq.qt import QtCore, QtGui, QtWidgets

__all__ = ["COLOURS", "Curves"]

# Of the emotions in the order of their names, and of the residual
COLOURS = ("#e0574f", "#8fbf4d", "#a884d9", "#f2c14e", "#4f9be0", "#f28b3c", "#5fc9c0", "#d67fb4")
_RESIDUAL = QtGui.QColor("#d8d8d8")
_GROUND, _HEAD = QtGui.QColor("#232629"), QtGui.QColor("#ffffff")


class Curves(QtWidgets.QWidget):
    """Emotions (0 to 1) above the residual.

    Signals
    -------
    clicked(int)
        The frame index that was clicked or dragged to.
    """

    clicked = QtCore.Signal(int)

    def __init__(self, parent: Any = None) -> None:
        super().__init__(parent)
        self.setMinimumHeight(120)
        self.setObjectName("usdfaceCurves")
        self._emotions: dict[str, Sequence[float]] = {}
        self._residual: Sequence[float] = ()
        self.frame = 0

    def set_curves(
        self, emotions: Mapping[str, Sequence[float]], residual_mm: Sequence[float]
    ) -> None:
        """Show other curves, each with a value for every frame."""
        self._emotions, self._residual = dict(emotions), residual_mm
        self.update()

    def set_frame(self, frame: int) -> None:
        """Move the play head."""
        if frame != self.frame:
            self.frame = frame
            self.update()

    @property
    def frames(self) -> int:
        """How many frames the curves have."""
        lengths = [len(curve) for curve in (*self._emotions.values(), self._residual)]
        return max(lengths, default=0)

    def paintEvent(self, event: Any) -> None:
        """Draw the curves and the play head."""
        painter = QtGui.QPainter(self)
        painter.setRenderHint(QtGui.QPainter.Antialiasing)
        painter.fillRect(self.rect(), _GROUND)
        low = 0.7 * self.height()
        for (_, curve), colour in zip(sorted(self._emotions.items()), COLOURS, strict=False):
            painter.setPen(QtGui.QPen(QtGui.QColor(colour), 1.5))
            painter.drawPolyline(self._points(curve, 4.0, low - 4.0, 1.0))
        if self._residual:
            painter.setPen(QtGui.QPen(_RESIDUAL, 1.0))
            most = max(1.0, *self._residual)
            painter.drawPolyline(self._points(self._residual, low + 4.0, self.height() - 4.0, most))
            painter.drawText(6, int(low) + 14, f"residual, top = {most:.1f} mm")
        if self.frames:
            painter.setRenderHint(QtGui.QPainter.Antialiasing, False)
            painter.setPen(QtGui.QPen(_HEAD, 1.0))
            x = round(self._x(self.frame))
            painter.drawLine(x, 0, x, self.height())
        painter.end()

    def mousePressEvent(self, event: Any) -> None:
        """Go to the frame under the pointer."""
        self._go(event)

    def mouseMoveEvent(self, event: Any) -> None:
        """Follow the pointer."""
        self._go(event)

    def _go(self, event: Any) -> None:
        if self.frames > 1:
            position = event.position() if hasattr(event, "position") else event.pos()
            share = position.x() / max(1, self.width() - 1)
            self.clicked.emit(round(min(max(share, 0.0), 1.0) * (self.frames - 1)))

    def _x(self, frame: int) -> float:
        return frame / max(1, self.frames - 1) * (self.width() - 1)

    def _points(self, curve: Sequence[float], top: float, bottom: float, most: float) -> Any:
        """Return a curve as points: at most one for each pixel, the largest value of those."""
        step = max(1, len(curve) // max(1, self.width()))
        return QtGui.QPolygonF(
            [
                QtCore.QPointF(
                    self._x(i), bottom - max(curve[i : i + step]) / most * (bottom - top)
                )
                for i in range(0, len(curve), step)
            ]
        )
