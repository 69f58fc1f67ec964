"""The dock in a window without a display, against a stand-in for usdview."""

import os
import stat
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from processed import shoot
from pxr import Usd
from worlds import make_world

pytestmark = pytest.mark.slow
pytest.importorskip("PySide6", reason="PySide6 is not installed: pip install -e '.[qt]'")

PLUGIN = Path(__file__).parents[2] / "plugins" / "usdview" / "usdface_usdview"
PATIENCE = 120.0  # s, for the worker


@pytest.fixture(scope="module")
def application() -> Iterator[Any]:
    os.environ["QT_QPA_PLATFORM"] = "offscreen"
    from PySide6 import QtWidgets
    from usdview_stand_in import install_stand_in

    install_stand_in()
    yield QtWidgets.QApplication.instance() or QtWidgets.QApplication([])
    for name in [n for n in sys.modules if n.startswith(("pxr.Usdviewq", "usdface_usdview"))]:
        del sys.modules[name]


@pytest.fixture(scope="module")
def shot(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return shoot(make_world().write(tmp_path_factory.mktemp("dock")))


@pytest.fixture
def usdview(application: Any, shot: Path) -> Iterator[Any]:
    from usdview_stand_in import Usdview

    shown = Usdview(Usd.Stage.Open(str(shot)))
    yield shown
    for dock in docks(shown):
        dock.close()


def docks(usdview: Any) -> list[Any]:
    from usdface_usdview.dock import Dock

    return list(usdview.qMainWindow.findChildren(Dock))


def opened(usdview: Any) -> Any:
    from usdface_usdview.commands import show_panel

    show_panel(usdview)
    (dock,) = docks(usdview)
    return dock


def wait(application: Any, until: Callable[[], object]) -> None:
    end = time.monotonic() + PATIENCE
    while not until():
        assert time.monotonic() < end, "the worker did not answer"
        application.processEvents()
        time.sleep(0.005)


def settled(application: Any, dock: Any) -> None:
    """Wait until nothing is asked any more."""
    quiet = time.monotonic()
    while time.monotonic() - quiet < 0.5:
        application.processEvents()
        time.sleep(0.005)
        if dock.worker.running:
            wait(application, lambda: not dock.worker.running)
            quiet = time.monotonic()


@pytest.fixture
def processed(application: Any, usdview: Any) -> Any:
    dock = opened(usdview)
    dock.process()
    assert dock.worker.running  # it returns at once
    wait(application, lambda: not dock.worker.running)
    settled(application, dock)
    return dock


def played(stage: Usd.Stage) -> np.ndarray:
    (prim,) = (p for p in stage.Traverse() if p.GetTypeName() == "SkelAnimation")
    attribute = prim.GetAttribute("blendShapeWeights")
    return np.array([attribute.Get(code) for code in attribute.GetTimeSamples()])


def warnings(dock: Any) -> list[str]:
    listed = dock.panel.warnings
    return [listed.item(i).text() for i in range(listed.count())]


def test_usdview_loads_the_menu_and_the_commands_make_one_dock(
    usdview: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    from pxr import Plug
    from usdview_stand_in import load_containers

    Plug.Registry().RegisterPlugins(str(PLUGIN))
    registry, builder = load_containers(usdview, usdview.qMainWindow)
    assert builder.menus["usdface"].items[0] == "Panel"
    registry.commands["UsdfaceContainer.show_panel"].run()
    registry.commands["UsdfaceContainer.show_panel"].run()
    assert len(docks(usdview)) == 1
    (dock,) = docks(usdview)
    assert usdview.qMainWindow.dockWidgetArea(dock).name == "RightDockWidgetArea"
    registry.commands["UsdfaceContainer.toggle_expressions"].run()
    assert not dock.panel.expressions.isChecked()


def test_the_window_lives_while_the_worker_solves(application: Any, usdview: Any) -> None:
    dock = opened(usdview)
    from pxr.Usdviewq.qt import QtCore

    beats: list[float] = []
    timer = QtCore.QTimer()
    timer.timeout.connect(lambda: beats.append(time.monotonic()))
    timer.start(10)
    dock.process()
    steps: list[str] = []
    dock.worker.step.connect(lambda name, fraction: steps.append(name))
    wait(application, lambda: not dock.worker.running)
    assert "solve" in steps and len(beats) > 20


def test_the_result_is_shown_and_nothing_is_written_beside_the_shot(
    processed: Any, usdview: Any, shot: Path
) -> None:
    assert played(usdview.stage).max() > 0.5
    assert sorted(p.name for p in shot.parent.iterdir()) == [
        "bind.json",
        "rig.usda",
        "shot.usda",
        "take.usda",
    ]
    assert processed.panel.status.text().startswith("verdict: ")
    assert processed.panel.curves.frames == 40
    assert processed.panel.frames.count() > 2
    assert {"joy", "surprise"} <= set(processed.panel.sliders)


def test_the_expression_layer_is_toggled(application: Any, processed: Any, usdview: Any) -> None:
    whole = played(usdview.stage)
    drawn = usdview.drawn
    processed.panel.expressions.setChecked(False)
    raw = played(usdview.stage)
    assert np.abs(raw - whole).max() > 0.05 and usdview.drawn > drawn
    processed.panel.expressions.setChecked(True)
    np.testing.assert_array_equal(played(usdview.stage), whole)


def test_a_gain_repaints_the_face(application: Any, processed: Any, usdview: Any) -> None:
    whole = played(usdview.stage)
    drawn = usdview.drawn
    for slider in processed.panel.sliders.values():
        slider.setValue(0)
    assert processed.panel.gains() == dict.fromkeys(processed.panel.sliders, 0.0)
    settled(application, processed)
    softer = played(usdview.stage)
    assert (softer <= whole + 1e-6).all() and np.abs(softer - whole).max() > 0.05
    assert usdview.drawn >= drawn + 2  # without the faces, and with them


def test_the_play_head_follows_and_a_click_goes_there(
    application: Any, processed: Any, usdview: Any
) -> None:
    usdview.set_frame(25.0)
    settled(application, processed)
    assert processed.panel.curves.frame == 25
    assert processed.panel.explanation.toPlainText().startswith("frame 25, ")
    processed.panel.curves.clicked.emit(11)
    assert usdview.frame.GetValue() == 11.0
    item = processed.panel.frames.item(1)
    processed.panel.frames.itemClicked.emit(item)
    assert f"frame {usdview.frame.GetValue():g}:" in item.text()


def test_the_curves_are_drawn_with_the_play_head(application: Any) -> None:
    from usdface_usdview.curves import COLOURS, Curves

    curves = Curves()
    curves.resize(300, 140)
    rise = np.linspace(0, 1, 40).tolist()
    curves.set_curves({"joy": rise, "fear": rise[::-1]}, [0.2] * 40)
    curves.set_frame(20)
    image = curves.grab().toImage()
    column = [image.pixelColor(round(20 / 39 * 299), y).lightness() for y in range(140)]
    assert sum(value > 200 for value in column) > 100
    # joy rises from left to right, fear falls: near the top each is at its own end
    for colour, own in zip(COLOURS, (range(90), range(210, 300)), strict=False):
        near = [x for x in range(300) for y in range(25) if image.pixelColor(x, y).name() == colour]
        assert near and set(near) <= set(own)


def test_the_residual_colours_the_face_of_the_frame(
    application: Any, processed: Any, usdview: Any
) -> None:
    from pxr import UsdGeom

    processed.panel.residual.setChecked(True)
    settled(application, processed)
    mesh = next(UsdGeom.Mesh(p) for p in usdview.stage.Traverse() if p.IsA(UsdGeom.Mesh))
    assert len(mesh.GetDisplayColorAttr().Get()) == len(mesh.GetPointsAttr().Get())
    processed.panel.residual.setChecked(False)
    mesh = next(UsdGeom.Mesh(p) for p in usdview.stage.Traverse() if p.IsA(UsdGeom.Mesh))
    assert not mesh.GetDisplayColorAttr().HasAuthoredValue()


def test_saving_writes_the_result_with_its_gains(
    application: Any, processed: Any, usdview: Any, tmp_path: Path
) -> None:
    processed.panel.sliders["joy"].setValue(0)
    settled(application, processed)
    processed.save_to(tmp_path / "mine.usda")
    wait(application, lambda: not processed.worker.running)
    saved = Usd.Stage.Open(str(tmp_path / "mine.usda"))
    np.testing.assert_allclose(played(saved), played(usdview.stage), atol=1e-6)
    assert "wrote" in usdview.said[0]


def test_a_killed_worker_is_said_and_a_new_one_starts(application: Any, usdview: Any) -> None:
    dock = opened(usdview)
    before = usdview.stage.Flatten().ExportToString()
    dock.process()
    wait(application, lambda: dock.worker._process.processId() > 0)
    dock.worker._process.kill()
    wait(application, lambda: not dock.worker.running)
    assert "the worker process ended before it answered" in warnings(dock)[-1]
    assert usdview.stage.Flatten().ExportToString() == before
    dock.panel.warnings.itemDoubleClicked.emit(
        dock.panel.warnings.item(dock.panel.warnings.count() - 1)
    )
    wait(application, lambda: not dock.worker.running)
    assert dock.panel.status.text().startswith("verdict")


def test_cancel_ends_the_worker(application: Any, usdview: Any) -> None:
    dock = opened(usdview)
    dock.process()
    dock.cancel()
    assert not dock.worker.running and dock.worker._process is None
    assert "cancelled" in dock.panel.status.text()
    assert not warnings(dock)


def test_a_read_only_folder_is_said_with_another_one_to_choose(
    application: Any, processed: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from PySide6 import QtWidgets

    locked = tmp_path / "locked"
    locked.mkdir()
    locked.chmod(stat.S_IRUSR | stat.S_IXUSR)
    if os.access(locked, os.W_OK):  # root may write everywhere: a file in place of the folder
        locked.rmdir()
        locked.write_text("")
    processed.save_to(locked / "result.usda")
    wait(application, lambda: not processed.worker.running)
    assert "save it in another folder" in warnings(processed)[-1]
    chosen = tmp_path / "other.usda"
    monkeypatch.setattr(QtWidgets.QFileDialog, "getSaveFileName", lambda *a, **k: (str(chosen), ""))
    listed = processed.panel.warnings
    listed.itemDoubleClicked.emit(listed.item(listed.count() - 1))
    wait(application, lambda: not processed.worker.running)
    assert chosen.exists()


def test_a_stage_without_a_set_up_is_said(application: Any, shot: Path) -> None:
    from usdview_stand_in import Usdview

    shown = Usdview(Usd.Stage.Open(str(shot.parent / "rig.usda")))
    dock = opened(shown)
    dock.process()
    assert "no usdface setup" in warnings(dock)[0]
    assert not dock.worker.running
    dock.close()


def test_another_stage_forgets_the_result(application: Any, processed: Any, usdview: Any) -> None:
    usdview.stage = None
    usdview.dataModel.signalStageReplaced.emit()
    assert processed.panel.curves.frames == 0 and not processed.panel.sliders
    processed.process()  # nothing is open: nothing happens
    assert not processed.worker.running


def test_closing_the_dock_takes_the_result_off_the_stage(
    application: Any, processed: Any, usdview: Any, shot: Path
) -> None:
    folder = processed._folder
    processed.close()
    plain = Usd.Stage.Open(str(shot))
    assert usdview.stage.Flatten().ExportToString() == plain.Flatten().ExportToString()
    assert not folder.exists() and processed.worker._process is None
