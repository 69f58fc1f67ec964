"""Draw the screens of the documentation: ``python docs/make_screens.py`` (needs Chromium).

The pages of the example are opened in a headless browser; its DevTools take the pictures. Those of
the tutorial are taken while its commands are followed.
"""

import shutil
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

DOCS = Path(__file__).parent
ROOT = DOCS.parent
sys.path.insert(0, str(ROOT / "tests"))

from bind_hand import drag_onto, saved, select, set_neutral  # noqa: E402
from chromium import Browser, Page, chromium_path, open_browser  # noqa: E402
from walkthrough import follow  # noqa: E402

import usdface  # noqa: E402

SIZE = (1240, 780)


@dataclass(frozen=True)
class Screen:
    """A picture: the page, the frame, and what a hand does there."""

    page: str
    frame: int
    act: Callable[[Page, Path], object]


def _run(expression: str) -> Callable[[Page, Path], object]:
    return lambda page, folder: page.run(f"void ({expression})")


def _slip(page: Page, folder: Path) -> None:
    """Put a marker of the brow onto the cheek, call a smile neutral, and save."""
    drag_onto(page, "brow_left_inner", "cheek_left_outer")
    set_neutral(page, 80, 90)
    saved(page, folder)


def _correct(page: Page, folder: Path) -> None:
    select(page, "brow_left_inner")
    page.key("m")
    saved(page, folder)


SCREENS = {
    "view.png": Screen("shot.html", 72, _run("usdface.setMode('both')")),
    "view_heat.png": Screen(
        "shot.html",
        392,
        _run("usdface.switch('heat'), usdface.switch('features'), usdface.open('gaps')"),
    ),
    "bind.png": Screen("bind.html", 0, _run("usdface.select(usdface.places.order()[0])")),
    "tutorial_bind.png": Screen("bind.html", 0, _slip),
    "tutorial_wrong.png": Screen(
        "shot.html",
        72,
        _run("usdface.setMode('both'), document.querySelector('details').open = true"),
    ),
    "tutorial_fixed.png": Screen("bind.html", 0, _correct),
    "tutorial_view.png": Screen("shot.html", 72, _run("usdface.setMode('both')")),
}


def picture(browser: Browser, folder: Path, name: str) -> bytes:
    """Return a screen as PNG, after the hand has done its part on the page."""
    screen = SCREENS[name]
    page = browser.page(folder / screen.page, f"#frame={screen.frame}", SIZE)
    screen.act(page, folder)
    return page.picture()


def follow_tutorial(browser: Browser, folder: Path) -> dict[str, bytes]:
    """Follow the tutorial in a folder, where the browser's downloads go, and return its screens."""
    pictures: dict[str, bytes] = {}

    def draw(name: str) -> None:
        pictures[name] = picture(browser, folder, name)

    shutil.copytree(ROOT / "examples", folder / "examples")
    follow(DOCS / "tutorial.md", folder, draw)
    return pictures


def example_screens(browser: Browser, folder: Path) -> dict[str, bytes]:
    """Process the example in a folder, write its pages and return their screens."""
    for name in ("head.usdc", "take.usdc", "shot.usda"):
        shutil.copy(ROOT / "examples" / name, folder)
    usdface.process(folder / "shot.usda")
    usdface.view(folder / "shot.usdface.usda", folder / "shot.html")
    usdface.make_bind_page(folder / "head.usdc", folder / "bind.html", take=folder / "take.usdc")
    names = [name for name in SCREENS if not name.startswith("tutorial")]
    return {name: picture(browser, folder, name) for name in names}


def main() -> None:
    """Write all screens into this folder."""
    executable = chromium_path()
    if executable is None:
        raise SystemExit("chromium is not installed")
    for make in (example_screens, follow_tutorial):
        with (
            tempfile.TemporaryDirectory() as place,
            open_browser(executable, Path(place)) as browser,
        ):
            pictures = make(browser, Path(place))
        for name, data in pictures.items():
            (DOCS / name).write_bytes(data)
            print(f"{name}: {len(data) / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
