"""A hand with mouse and keys on the page of `usdface view`, in a real browser."""

import json
import math
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from chromium import Browser, Page, chromium_path, open_browser

from usdface.cli import main

pytestmark = pytest.mark.slow

SIDE = math.pi / 2


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    executable = chromium_path()
    if not executable or not shutil.which("bash"):
        pytest.skip("chromium is not installed; .ci/run installs it")
    with open_browser(executable) as opened:
        yield opened


@pytest.fixture
def shot(browser: Browser, example: Path) -> Page:
    """The page of the example's shot."""
    html = example / "controls.html"
    if not html.exists():
        assert main(["view", str(example / "shot.usdface.usda"), "-o", str(html)]) == 0
    return browser.page(html, "#frame=72")


def focus(page: Page, text: str) -> None:
    find = f"find((b) => b.textContent === {json.dumps(text)})"
    page.run(f"[...document.querySelectorAll('button')].{find}.focus()")


def test_columns_stand_beside_each_other_from_the_side(shot: Page) -> None:
    shot.run(f"usdface.setMode('both'), usdface.stage.fit({SIDE}), usdface.stage.draw()")
    lefts = shot.run("usdface.stage.columns.map(({ tag }) => tag.getBoundingClientRect().left)")
    assert len(lefts) == 3, "raw, corrected, performer"
    assert all(right - left > 150 for left, right in zip(lefts, lefts[1:], strict=False))


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
