"""The dock: between usdview, the worker that computes and the widgets that draw."""

import base64
import shutil
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Tf
from pxr.Usdviewq.qt import QtCore, QtWidgets

from usdface_usdview.explanation_text import explanation_text
from usdface_usdview.panel import Panel
from usdface_usdview.preview import Preview, shot_file
from usdface_usdview.worker_client import WorkerClient

__all__ = ["Dock"]

_POLL, _SETTLE = 50, 150  # ms: how often the frame is looked at; rest before the worker is asked
_WORDS = {"good": "good", "look_at": "look at", "not_usable": "not usable"}


class Dock(QtWidgets.QDockWidget):
    """The dock of usdface in usdview.

    Parameters
    ----------
    usdview : UsdviewApi
    parent : QMainWindow
    """

    def __init__(self, usdview: Any, parent: Any) -> None:
        super().__init__("usdface", parent)
        self.setObjectName("usdfaceDock")
        self._usdview = usdview
        self._preview: Preview | None = None
        self._folder: Path | None = None
        self._codes: list[float] = []  # of the take's frames
        self._result: dict[str, Any] = {}
        self._asked_frame = -1
        self.panel = Panel(self)
        self.setWidget(self.panel)
        self.worker = WorkerClient(self)
        self.worker.step.connect(self.panel.set_step)
        self.worker.busy.connect(self.panel.set_busy)
        self.worker.failed.connect(self._show_error)
        self.panel.process.clicked.connect(lambda *_: self.process())
        self.panel.cancel.clicked.connect(lambda *_: self.cancel())
        self.panel.save.clicked.connect(lambda *_: self.save())
        self.panel.layers_changed.connect(self._mute)
        self.panel.residual_changed.connect(self._toggle_residual)
        self.panel.frame_chosen.connect(self.go_to)
        self._timer(_POLL, self._look_at_frame).start()
        self._settled = self._timer(_SETTLE, self._ask_for_frame, once=True)
        self._gains_settled = self._timer(_SETTLE, self._apply_gains, once=True)
        self.panel.gains_changed.connect(self._gains_settled.start)
        usdview.dataModel.signalStageReplaced.connect(self._stage_replaced)

    def process(self) -> None:
        """Process the shot that is open, in the worker; the result is shown over the stage."""
        shot = self._shot()
        if shot is None:
            return
        self._clear()
        unsaved = [each for each in self._usdview.stage.GetUsedLayers() if each.dirty]
        names = [Path(each.realPath).name for each in unsaved if not each.anonymous]
        if names:
            self.panel.warn(f"changes that are not saved are not processed: {', '.join(names)}")
        self._ask_to_process(shot, again=False)

    def cancel(self) -> None:
        """End the worker; the stage stays as it is."""
        self.worker.end()
        self.panel.status.setText("cancelled; the stage is as it was")

    def save(self) -> None:
        """Ask for a file, and write the result there."""
        shot = self._shot()
        if shot is None:
            return
        proposed = str(shot.with_name(f"{shot.stem}.usdface.usda"))
        chosen, _ = QtWidgets.QFileDialog.getSaveFileName(
            self, "Save the result", proposed, "USD (*.usda *.usdc)"
        )
        if chosen:
            self.save_to(Path(chosen))

    def save_to(self, root: Path) -> None:
        """Write the result as files, with the gains as they are.

        Another file at `root` is replaced: the file dialog has asked.
        """
        shot = self._shot()
        if shot is not None:
            self.worker.ask(
                "process",
                self._saved,
                shot=str(shot),
                output=str(root),
                overwrite=True,
                gains=self.panel.gains(),
                again=True,
            )

    def go_to(self, frame: int) -> None:
        """Go to a frame of the take."""
        if not 0 <= frame < len(self._codes):
            return
        field = self._usdview.qMainWindow.findChild(QtWidgets.QLineEdit, "frameField")
        if field is not None:  # as if it were typed there: plug-ins have no other way
            field.setText(f"{self._codes[frame]:g}")
            field.editingFinished.emit()

    def _shot(self) -> Path | None:
        """Return the file of the shot; where there is none, say why."""
        if self._usdview.stage is None:
            return None
        shot, why = shot_file(self._usdview.stage)
        if shot is None:
            self._show_error(why)
        return shot

    def _ask_to_process(self, shot: Path, *, again: bool) -> None:
        if self._folder is None:
            self._folder = Path(tempfile.mkdtemp(prefix="usdface-"))
        self.worker.ask(
            "process",
            lambda said: self._show_result(said, again),
            shot=str(shot),
            output=str(self._folder / "shot.usdface.usda"),
            gains=self.panel.gains() if again else {},
            again=again,
        )

    def _show_result(self, said: dict[str, Any], again: bool) -> None:
        self._result = said
        if self._preview is None:
            self._preview = Preview(self._usdview.stage, self._draw)
        self._preview.show(said["written"][1:], self.panel.muted())
        self._codes = self._preview.frames
        if not again:
            self.panel.set_gains(said["gains"])
            self.panel.set_frames(said["frames"])
        self.panel.curves.set_curves(said["emotions"], said["residual_mm"])
        self._list_warnings(said)
        self.panel.set_result(True)
        verdict, mean = said["verdict"], said["summary"].get("residual_mean_mm")
        words = [f"verdict: {_WORDS[verdict['level']]}" if verdict else "processed"]
        words += [f"residual {mean:g} mm"] if mean is not None else []
        self.panel.status.setText(", ".join(words))
        self._asked_frame = -1
        self._settled.start()

    def _saved(self, said: dict[str, Any]) -> None:
        message = f"wrote {said['written'][0]}"
        self.panel.status.setText(message)
        self._usdview.PrintStatus(f"usdface {message}")

    def _list_warnings(self, said: dict[str, Any]) -> None:
        self.panel.clear_warnings()
        for reason in (said["verdict"] or {"reasons": []})["reasons"]:
            first = next(iter(reason["frames"]), None)
            action = (
                None if first is None else (f"go to frame {first}", lambda f=first: self.go_to(f))
            )
            self.panel.warn(f"{reason['message']}: {reason['remedy']}", action)
        for each in said["findings"]:
            if each["severity"] != "info":
                where = f" ({each['where']})" if each["where"] else ""
                self.panel.warn(f"{each['code']}: {each['message']}{where}")

    def _show_error(self, message: str, code: str = "") -> None:
        """Say it in the dock, and as a warning of USD, which usdview prints."""
        self.panel.status.setText("not done; see the warnings")
        action = ("save it in another folder", self.save) if code == "OUTPUT_UNWRITABLE" else None
        if code == "WORKER_ENDED":
            action = ("process again", self.process)
        self.panel.warn(message, action)
        Tf.Warn(f"usdface: {message}")

    def _look_at_frame(self) -> None:
        """Follow usdview's frame: there is no signal for it."""
        frame = self._frame()
        if frame != self.panel.curves.frame:
            self.panel.curves.set_frame(frame)
            self._settled.start()

    def _frame(self) -> int:
        code = self._usdview.frame
        if not self._codes or code.IsDefault():
            return 0
        return int(np.abs(np.array(self._codes) - code.GetValue()).argmin())

    def _ask_for_frame(self) -> None:
        """Ask for the explanation and the colours of the frame, once it rests."""
        frame = self._frame()
        if not self._result or frame == self._asked_frame or self._usdview.dataModel.playing:
            return
        if self.worker.running:
            self._settled.start()
            return
        self._asked_frame = frame
        if self._result["emotions"]:
            self.worker.ask("explain", self._show_explanation, frame=frame)
        if self.panel.residual.isChecked():
            self.worker.ask("colours", self._show_colours, frame=frame)

    def _show_explanation(self, said: dict[str, Any]) -> None:
        self.panel.explanation.setPlainText(explanation_text(said))

    def _show_colours(self, said: dict[str, Any]) -> None:
        if self._preview is not None and self.panel.residual.isChecked():
            values = np.frombuffer(base64.b64decode(said["colours"]), np.float32)
            self._preview.paint(said["mesh"], values.reshape(-1, 3))

    def _mute(self) -> None:
        if self._preview is not None:
            self._preview.mute(self.panel.muted())

    def _toggle_residual(self, on: bool) -> None:
        if not on and self._preview is not None:
            self._preview.unpaint()
        self._asked_frame = -1
        self._settled.start()

    def _apply_gains(self) -> None:
        if self.worker.running:
            self._gains_settled.start()
            return
        shot = self._shot()
        if shot is not None:
            self._ask_to_process(shot, again=True)

    def _clear(self) -> None:
        """Forget the result that is shown."""
        self.panel.clear_warnings()
        self.panel.set_frames([])
        self.panel.explanation.clear()
        self.panel.curves.set_curves({}, [])
        self._result, self._codes = {}, []

    def _stage_replaced(self) -> None:
        """Another stage is open, or none: nothing of ours is on it."""
        self._preview = None
        self._end()

    def closeEvent(self, event: Any) -> None:
        """Take the result off the stage when the dock is closed."""
        if self._preview is not None:
            self._preview.remove()
            self._preview = None
        self._end()
        super().closeEvent(event)

    def _end(self) -> None:
        self.worker.end()
        self._clear()
        self.panel.set_gains({})
        self.panel.set_result(False)
        self.panel.status.setText("")
        if self._folder is not None:
            shutil.rmtree(self._folder, ignore_errors=True)
            self._folder = None

    def _draw(self) -> None:
        """Draw at once: UpdateViewport alone only schedules it."""
        self._usdview.GrabViewportShot()
        self._usdview.UpdateViewport()

    def _timer(self, interval: int, function: Any, once: bool = False) -> Any:
        timer = QtCore.QTimer(self)
        timer.setInterval(interval)
        timer.setSingleShot(once)
        timer.timeout.connect(function)
        return timer
