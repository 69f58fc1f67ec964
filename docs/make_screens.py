"""Draw the screens of the documentation: ``python docs/make_screens.py`` (needs Chromium).

The pages of the example are opened in a headless browser; its DevTools take the pictures.
"""

import shutil
import sys
import tempfile
from pathlib import Path

DOCS = Path(__file__).parent
ROOT = DOCS.parent
SIZE = (1240, 780)
# Picture: page, frame, what is done on the page.
SCREENS = {
    "view.png": ("shot.html", 72, "usdface.setMode('both')"),
    "view_heat.png": (
        "shot.html",
        392,
        "usdface.switch('heat'), usdface.switch('features'), usdface.open('gaps')",
    ),
    "bind.png": ("bind.html", 0, "usdface.select(usdface.places.order()[0])"),
}


def main() -> None:
    """Process the example, write its pages and draw them."""
    sys.path.insert(0, str(ROOT / "tests"))
    from chromium import chromium_path, open_browser

    import usdface

    executable = chromium_path()
    if executable is None:
        raise SystemExit("chromium is not installed")
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        for name in ("head.usdc", "take.usdc", "shot.usda"):
            shutil.copy(ROOT / "examples" / name, folder)
        usdface.process(folder / "shot.usda")
        usdface.view(folder / "shot.usdface.usda", folder / "shot.html")
        take = folder / "take.usdc"
        usdface.make_bind_page(folder / "head.usdc", folder / "bind.html", take=take)
        with open_browser(executable) as browser:
            for name, (page, frame, action) in SCREENS.items():
                shown = browser.page(folder / page, f"#frame={frame}", SIZE)
                shown.run(f"void ({action})")
                (DOCS / name).write_bytes(shown.picture())
                print(f"{name}: {(DOCS / name).stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
