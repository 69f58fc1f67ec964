"""Run by test_storm: the dock over Storm, in a stand-in for usdview. Writes pictures, prints JSON.

``storm_pictures.py SHOT FOLDER CODE``
"""

import json
import sys
import time
from pathlib import Path

import numpy as np
from PySide6 import QtGui, QtWidgets
from storm import StormView
from usdview_stand_in import Usdview, install_stand_in

application = QtWidgets.QApplication([])
install_stand_in()

from pxr import Usd  # noqa: E402
from usdface_usdview.commands import show_panel  # noqa: E402
from usdface_usdview.dock import Dock  # noqa: E402

shot, folder, code = sys.argv[1], Path(sys.argv[2]), float(sys.argv[3])
stage = Usd.Stage.Open(shot)
view = StormView(stage, 320)
usdview = Usdview(stage)
usdview.GrabViewportShot = lambda: view.draw(code)  # type: ignore[method-assign]
usdview.set_frame(code)
show_panel(usdview)
dock = usdview.qMainWindow.findChild(Dock)
errors: list[str] = []
dock.worker.failed.connect(lambda message, code: errors.append(message))


def settle() -> None:
    quiet = time.monotonic()
    while time.monotonic() - quiet < 0.5:
        application.processEvents()
        time.sleep(0.005)
        if dock.worker.running:
            quiet = time.monotonic()


def picture(name: str) -> np.ndarray:
    image = view.draw(code)
    image.save(str(folder / f"{name}.png"))
    image = image.convertToFormat(QtGui.QImage.Format_RGB888)
    lines = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), -1)
    return lines[:, : 3 * image.width()].astype(int)


def differing(one: np.ndarray, other: np.ndarray) -> int:
    """Values that differ by more than dithering of an edge does."""
    return int((np.abs(one - other) > 12).sum())


unprocessed = picture("unprocessed")
dock.process()
settle()
expressive = picture("expressive")
dock.panel.expressions.setChecked(False)
raw = picture("raw")
dock.panel.expressions.setChecked(True)
again = picture("again")
for slider in dock.panel.sliders.values():
    slider.setValue(0)
settle()
without = picture("without")
dock.panel.closure.setChecked(False)
without_closure = picture("without_closure")
dock.panel.closure.setChecked(True)
for slider in dock.panel.sliders.values():
    slider.setValue(100)
settle()
dock.panel.residual.setChecked(True)
settle()
residual = picture("residual")
dock.panel.residual.setChecked(False)
plain = picture("plain")
dock.close()
closed = picture("closed")
print(
    json.dumps(
        {
            "errors": errors,
            "processed": differing(unprocessed, expressive),
            "expressive_raw": differing(expressive, raw),
            "expressive_again": differing(expressive, again),
            "gains_0_raw": differing(without_closure, raw),
            "gains_0_expressive": differing(without, expressive),
            "residual": differing(residual, expressive),
            "plain_expressive": differing(plain, expressive),
            "closed_unprocessed": differing(closed, unprocessed),
        }
    )
)
