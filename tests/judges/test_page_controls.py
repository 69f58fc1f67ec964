"""A hand with mouse and keys on the pages of `usdface view` and `bind`, in a real browser."""

import json
import math
import shutil
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest
from bind_hand import saved, select
from chromium import Browser, Page, chromium_path, open_browser
from worlds import make_world

from usdface.cli import main
from usdface.io.bind_file import read_bind

pytestmark = pytest.mark.slow

SIDE = math.pi / 2


@pytest.fixture(scope="module")
def downloads(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("downloads")


@pytest.fixture(scope="module")
def browser(downloads: Path) -> Iterator[Browser]:
    executable = chromium_path()
    if not executable or not shutil.which("bash"):
        pytest.skip("chromium is not installed; .ci/run installs it")
    with open_browser(executable, downloads) as opened:
        yield opened


@pytest.fixture
def shot(browser: Browser, example: Path) -> Page:
    """The page of the example's shot."""
    html = example / "controls.html"
    if not html.exists():
        assert main(["view", str(example / "shot.usdface.usda"), "-o", str(html)]) == 0
    return browser.page(html, "#frame=72")


@pytest.fixture(scope="module")
def bind_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A page of places that are all given, but for one marker that has none."""
    world = make_world()
    markers = {name: {"point": point} for name, point in world.points.items() if name != "brow"}
    folder = world.write(tmp_path_factory.mktemp("controls"), markers=markers)
    html = folder / "bind.html"
    words = ["--take", str(folder / "take.usda"), "--bind", str(folder / "bind.json")]
    assert main(["bind", str(folder / "rig.usda"), *words, "-o", str(html)]) == 0
    return html


@pytest.fixture
def bind(browser: Browser, bind_file: Path) -> Page:
    return browser.page(bind_file)


def focus(page: Page, text: str) -> None:
    find = f"find((b) => b.textContent === {json.dumps(text)})"
    page.run(f"[...document.querySelectorAll('button')].{find}.focus()")


def test_columns_stand_beside_each_other_from_the_side(shot: Page) -> None:
    shot.run(f"usdface.setMode('both'), usdface.stage.fit({SIDE}), usdface.stage.draw()")
    lefts = shot.run("usdface.stage.columns.map(({ tag }) => tag.getBoundingClientRect().left)")
    assert len(lefts) == 3, "raw, corrected, performer"
    assert all(right - left > 150 for left, right in pairwise(lefts))


def test_a_view_outlasts_a_change_of_the_windows_size(shot: Page) -> None:
    shot.drag((400, 300), (520, 320))
    turned = shot.run("usdface.stage.camera.position.toArray()")
    shot.resize(1000, 700)
    shot.wait("usdface.stage.renderer.domElement.width < 700")
    assert shot.run("usdface.stage.camera.position.toArray()") == turned


def test_space_on_a_focused_button_presses_it(shot: Page) -> None:
    focus(shot, "heat")
    shot.key(" ")
    assert shot.run("[usdface.on.heat, usdface.player.playing]") == [True, False]


def test_curves_show_the_frames_of_the_zoomed_timeline(shot: Page) -> None:
    shot.run("usdface.open('curves')")
    shot.wait("usdface.curves.seen.size > 3")
    drawn = "document.querySelector('.curve canvas').toDataURL()"
    before = shot.run(drawn)
    x, y = shot.run("(({ left, top }) => [left + 100, top + 30])(ribbon.getBoundingClientRect())")
    shot.call("Input.dispatchMouseEvent", type="mouseWheel", x=x, y=y, deltaX=0, deltaY=-600)
    shot.wait("usdface.timeline.view")
    zoomed = shot.run(drawn)
    assert zoomed != before
    shot.run("usdface.timeline.showAll()")
    assert shot.run(drawn) == before


def test_a_typed_frame_is_kept_within_the_take_and_enter_gives_the_keys_back(shot: Page) -> None:
    shot.run("usdface.frameInput.focus(), usdface.frameInput.value = 9999")
    shot.run("usdface.frameInput.dispatchEvent(new Event('change'))")
    assert shot.run("usdface.frameInput.value") == "719"
    shot.key("Enter")
    shot.key("ArrowLeft")
    assert shot.run("usdface.player.frame") == 718


def test_a_face_that_sliders_hold_is_called_so(shot: Page) -> None:
    names = "usdface.stage.columns.map(({ tag }) => tag.textContent)"
    shot.run("usdface.setMode('both'), usdface.sliders.set(new Float32Array(52))")
    assert shot.run(names) == ["as the sliders", "as the sliders", "performer"]
    shot.run("usdface.sliders.set(null)")
    assert shot.run(names) == ["raw", "corrected", "performer"]


def test_enter_on_save_saves_and_accepts_no_marker(bind: Page, downloads: Path) -> None:
    file = downloads / "bind.json"
    file.unlink(missing_ok=True)
    focus(bind, "save bind.json")
    bind.key("Enter")
    bind.wait("usdface.saved")
    assert not bind.run("usdface.places.undoable"), "no marker was accepted"


def test_undo_takes_back_nose_tip_and_neutral_but_no_step_that_changed_nothing(
    bind: Page, downloads: Path
) -> None:
    before = read_bind(saved(bind, downloads))[0]
    select(bind, "bridge")
    bind.key("r")
    assert not bind.run("usdface.places.undoable"), "it was as proposed"
    bind.key("t")
    bind.run("usdface.player.seek(5)")
    bind.key("i")
    after = read_bind(saved(bind, downloads))[0]
    assert (after.nose_tip, after.neutral) != (before.nose_tip, before.neutral)
    bind.key("z")
    bind.key("z")
    again = read_bind(saved(bind, downloads))[0]
    assert (again.nose_tip, again.neutral) == (before.nose_tip, before.neutral)


def test_markers_behind_the_head_are_not_shown(bind: Page) -> None:
    select(bind, "bridge")
    shown = (
        "usdface.stage.draw(), usdface.page.markers.filter("
        "(_, i) => usdface.stage.screen(usdface.markers, i)).map(({ name }) => name)"
    )
    assert len(bind.run(shown)) == bind.run("usdface.places.count") - 1, "one has no place"
    bind.run(f"usdface.stage.fit({2 * SIDE})")
    assert bind.run(shown) == ["bridge"], "the selected one is still to be found"


def test_a_long_name_ends_inside_the_stage(bind: Page) -> None:
    bind.run("usdface.select(usdface.page.markers.findIndex(({ name }) => name === 'bridge'))")
    bind.run("usdface.page.markers[usdface.selected].name = 'brow_'.repeat(60)")
    bind.run("usdface.stage.draw()")
    ends = bind.run("usdface.labels.map((label) => label.getBoundingClientRect().right)")
    assert max(ends) <= bind.run("usdface.stage.place.getBoundingClientRect().right")
