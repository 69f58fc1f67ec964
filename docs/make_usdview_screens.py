"""Draw docs/usdview.png and docs/usdview_faces.png: ``python docs/make_usdview_screens.py``.

The dock is ours, the faces are drawn by Storm, USD's renderer; the window around them is a stand-in
for usdview (tests/usdview_stand_in.py), which no package registry carries. It needs what
tests/storm.py names: Xvfb, PySide6, and Blender's module for its pxr.
"""

import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parent
ROOT = DOCS.parent
FRAME = 76  # joy
VIEW, HEIGHT = 760, 1080  # px


def main() -> None:
    """Run this script again, below Xvfb and with Storm."""
    sys.path.insert(0, str(ROOT / "tests"))
    from storm import command

    if len(sys.argv) > 1:
        draw(Path(sys.argv[1]))
        return
    with tempfile.TemporaryDirectory() as folder:
        for name in ("head.usdc", "take.usdc", "shot.usda"):
            (Path(folder) / name).write_bytes((ROOT / "examples" / name).read_bytes())
        call = command(Path(__file__), folder)
        if isinstance(call, str):
            raise SystemExit(call)
        subprocess.run(call[0], env=call[1], check=True, timeout=300)


def draw(folder: Path) -> None:
    """Process the example in the dock, and save the window and the faces."""
    from PySide6 import QtGui, QtWidgets
    from storm import StormView
    from usdview_stand_in import Usdview, install_stand_in

    application = QtWidgets.QApplication([])
    application.setStyle("Fusion")
    application.setPalette(_dark(QtGui))
    install_stand_in()
    from pxr import Usd
    from usdface_usdview.commands import show_panel
    from usdface_usdview.dock import Dock

    stage = Usd.Stage.Open(str(folder / "shot.usda"))
    view = StormView(stage, VIEW)
    usdview = Usdview(stage)
    window = usdview.qMainWindow
    shown = QtWidgets.QLabel()
    window.setCentralWidget(shown)
    window.menuBar().addMenu("usdface")
    window.resize(VIEW + 420, HEIGHT)

    def redraw() -> None:
        shown.setPixmap(QtGui.QPixmap.fromImage(view.draw(FRAME)))

    usdview.GrabViewportShot = redraw  # type: ignore[method-assign]
    show_panel(usdview)
    dock: Any = window.findChild(Dock)
    window.show()
    window.resizeDocks([dock], [400], _horizontal())

    def settle() -> None:
        quiet = time.monotonic()
        while time.monotonic() - quiet < 0.6:
            application.processEvents()
            time.sleep(0.005)
            if dock.worker.running:
                quiet = time.monotonic()

    dock.process()
    settle()
    usdview.set_frame(FRAME)
    settle()
    redraw()
    application.processEvents()
    window.grab().save(str(DOCS / "usdview.png"))
    faces = [view.draw(FRAME)]
    dock.panel.expressions.setChecked(False)
    faces.insert(0, view.draw(FRAME))
    dock.panel.expressions.setChecked(True)
    dock.panel.residual.setChecked(True)
    settle()
    faces.append(view.draw(FRAME))
    strip = QtGui.QImage(3 * 460, 500, QtGui.QImage.Format_RGB32)
    painter = QtGui.QPainter(strip)
    for number, face in enumerate(faces):
        left, top = (VIEW - 460) // 2, (VIEW - 500) // 2
        painter.drawImage(460 * number, 0, face.copy(left, top, 460, 500))
    painter.end()
    strip.save(str(DOCS / "usdview_faces.png"))
    dock.close()


def _horizontal() -> Any:
    from PySide6 import QtCore

    return QtCore.Qt.Horizontal


def _dark(gui: Any) -> Any:
    """Return a dark palette, as usdview has."""
    palette = gui.QPalette()
    role = gui.QPalette
    for roles, colour in (
        ((role.Window, role.Button), "#3a3d42"),
        ((role.Base, role.AlternateBase), "#2b2e32"),
        ((role.Text, role.WindowText, role.ButtonText), "#e4e6e8"),
        ((role.Highlight,), "#c98f3a"),
    ):
        for each in roles:
            palette.setColor(each, gui.QColor(colour))
    return palette


if __name__ == "__main__":
    main()
