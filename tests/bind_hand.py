"""A hand on the page of `usdface bind`: it finds markers, drags them, presses keys, saves."""

import json
import time
from pathlib import Path

from chromium import Page

__all__ = ["drag_onto", "place_of", "saved", "select", "set_neutral"]


def place_of(page: Page, name: str) -> tuple[float, float]:
    """Where a marker of the face is in the window."""
    page.run("usdface.stage.draw()")
    at = page.run(
        "(() => { const i = usdface.page.markers.findIndex(({ name }) => name === "
        f"{json.dumps(name)}); const at = usdface.stage.screen(usdface.markers, i);"
        "const box = usdface.stage.place.getBoundingClientRect();"
        "return at && [at.x + box.left, at.y + box.top]; })()"
    )
    assert at is not None, f"{name} is not shown"
    return at[0], at[1]


def select(page: Page, name: str) -> None:
    find = f"usdface.page.markers.findIndex(({{ name }}) => name === {json.dumps(name)})"
    page.run(f"usdface.select({find})")


def drag_onto(page: Page, name: str, other: str) -> None:
    """Drag a marker to beside another one."""
    x, y = place_of(page, other)
    page.drag(place_of(page, name), (x + 6, y + 6))


def set_neutral(page: Page, first: int, last: int) -> None:
    """Go to two frames and mark them as the first and the last neutral one."""
    for frame, key in ((first, "i"), (last, "o")):
        page.run(f"usdface.player.seek({frame})")
        page.key(key)


def saved(page: Page, downloads: Path) -> Path:
    """Press save and return the file."""
    file = downloads / "bind.json"
    file.unlink(missing_ok=True)
    page.run("document.querySelector('button.save').click()")
    end = time.monotonic() + 20
    while not (file.exists() and file.stat().st_size):
        assert time.monotonic() < end, "nothing was saved"
        time.sleep(0.05)
    return file
