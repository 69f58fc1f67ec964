"""Draw docs/maya.png: ``python docs/make_maya_screens.py``.

A character as Maya exports it, and the same after the work of the chaser, drawn by Storm. Maya is
not part of it. It needs what tests/storm.py names.
"""

import subprocess
import sys
from pathlib import Path

DOCS = Path(__file__).parent
ROOT = DOCS.parent
FRAME, SIZE = 76, 460


def main() -> None:
    """Run this script again, below Xvfb and with Storm."""
    sys.path.insert(0, str(ROOT / "tests"))
    from storm import command

    if len(sys.argv) > 1:
        draw()
        return
    call = command(Path(__file__), "draw")
    if isinstance(call, str):
        raise SystemExit(call)
    subprocess.run(call[0], env=call[1], check=True, timeout=300)


def draw() -> None:
    """Save the two faces side by side."""
    from PySide6 import QtGui, QtWidgets
    from storm import StormView

    application = QtWidgets.QApplication([])
    sys.path.insert(0, str(ROOT / "plugins" / "maya"))
    from pxr import Usd
    from usdface_maya.shot import apply

    examples = ROOT / "examples"
    faces = []
    for retargeted in (False, True):
        stage = Usd.Stage.Open(str(examples / "head.usdc"))
        stage.SetEditTarget(stage.GetSessionLayer())
        view = StormView(stage, SIZE)
        if retargeted:
            take, bind = examples / "performance.trc", examples / "bind.json"
            apply(stage, {"take": str(take), "bind": str(bind)})
        # The character has its clock, the take's first frame is at 0 s of it
        code = FRAME / 60.0 * stage.GetTimeCodesPerSecond()
        faces.append(view.draw(code))
    strip = QtGui.QImage(2 * SIZE, SIZE, QtGui.QImage.Format_RGB32)
    painter = QtGui.QPainter(strip)
    for number, face in enumerate(faces):
        painter.drawImage(SIZE * number, 0, face)
    painter.end()
    strip.save(str(DOCS / "maya.png"))
    application.quit()


if __name__ == "__main__":
    main()
