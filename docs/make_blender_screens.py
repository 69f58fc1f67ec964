"""Draw the pictures of blender.md: ``python docs/make_blender_screens.py``.

Needs Chromium, and Blender as a module with the extension's package, as `.ci/run` makes them in
``.venv-blender``. Blender renders the viewport's content. Its sidebar needs a window, which that
module does not open: the sidebar is drawn from the calls that the panels make.
"""

import base64
import html
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

DOCS = Path(__file__).resolve().parent
ROOT = DOCS.parent
PYTHON = ROOT / ".venv-blender" / "bin" / "python"
PACKAGE = ROOT / ".venv-blender" / "usdface.zip"
INSTALL = (
    "import bpy; bpy.ops.extensions.package_install_files("
    f"filepath={str(PACKAGE)!r}, repo='user_default', enable_on_install=False)"
)
STYLE = """
body { margin: 0; background: #303030; color: #ddd; font: 12px sans-serif; display: flex; }
figure { margin: 0; background: #3a3a3a; position: relative; flex: 1; }
main { display: flex; flex-direction: column; }
figure img { display: block; }
figcaption { position: absolute; top: 10px; left: 12px; }
aside { width: 300px; padding: 6px; background: #282828; }
section { background: #303030; border-radius: 4px; margin-bottom: 5px; padding: 5px 8px 7px; }
h1 { font: 12px sans-serif; margin: 0 0 5px; }
.column { display: flex; flex-direction: column; gap: 3px; }
.row { display: flex; gap: 3px; } .row > * { flex: 1; }
.icon { flex: 0 0 14px !important; }
.button { background: #545454; border-radius: 3px; padding: 3px 6px; text-align: center; }
.field, .number { background: #1d1d1d; border-radius: 3px; padding: 3px 6px; display: flex;
  justify-content: space-between; gap: 8px; white-space: nowrap; overflow: hidden; }
.number { background-color: #454545; }
.on { background: #4772b3; }
.line { padding: 1px 2px; white-space: nowrap; overflow: hidden; }
"""


def main() -> None:
    """Render in Blender and put the pictures together."""
    sys.path.insert(0, str(ROOT / "tests"))
    from chromium import chromium_path, open_browser

    executable = chromium_path()
    if executable is None or not PYTHON.exists() or not PACKAGE.exists():
        raise SystemExit("needs Chromium, .venv-blender and .venv-blender/usdface.zip: see .ci/run")
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        environment = {**os.environ, "BLENDER_USER_RESOURCES": str(folder / "blender")}
        for command in (["-c", INSTALL], [str(DOCS / "blender_scene.py"), place]):
            subprocess.run([PYTHON, *command], check=True, env=environment, timeout=600)
        panels = json.loads((folder / "panels.json").read_text())
        pictures = {
            "blender_markers.png": ([("markers", "")], panels["before"], (820, 620)),
            "blender_result.png": (
                [("raw", "influence 0: raw"), ("expressive", "influence 1: expressive")],
                panels["after"],
                (834, 1240),
            ),
        }
        with open_browser(executable) as browser:
            for name, (renders, drawn, size) in pictures.items():
                page = folder / f"{name}.html"
                page.write_text(document(folder, renders, drawn), encoding="utf-8")
                (DOCS / name).write_bytes(browser.page(page, "", size).picture())
                print(f"{name}: {(DOCS / name).stat().st_size / 1e3:.0f} kB")


def document(folder: Path, renders: list[tuple[str, str]], panels: list[dict]) -> str:
    """Return a page of renders and a sidebar."""
    figures = ""
    for name, caption in renders:
        data = base64.b64encode((folder / f"{name}.png").read_bytes()).decode()
        figures += (
            f'<figure><img src="data:image/png;base64,{data}">'
            f"<figcaption>{html.escape(caption)}</figcaption></figure>"
        )
    sections = "".join(
        f"<section><h1>{html.escape(panel['title'])}</h1>{drawn(panel['layout'])}</section>"
        for panel in panels
    )
    return (
        f'<!doctype html><meta charset="utf-8"><style>{STYLE}</style>'
        '<title>usdface</title><body data-ready="true">'
        f"<main>{figures}</main><aside>{sections}</aside>"
    )


def drawn(item: dict) -> str:
    """Return an item of a layout as HTML."""
    if "items" in item:
        kind = "row" if item["across"] else "column"
        return f'<div class="{kind}">{"".join(map(drawn, item["items"]))}</div>'
    text = {key: html.escape(str(value)) for key, value in item.items()}
    if "button" in item:
        kind = "button" if text["button"] else "button icon"
        return f'<div class="{kind}">{text["button"] or "&#8226;"}</div>'
    if "tab" in item:
        return f'<div class="button {"on" if item["on"] else ""}">{text["tab"]}</div>'
    if "check" in item:
        return f'<div class="line">{"&#9745;" if item["on"] else "&#9744;"} {text["check"]}</div>'
    if "label" in item:
        return f'<div class="line">{text["label"] or "&nbsp;"}</div>'
    if "number" in item:
        share = f"{100 * item['share']:.0f}%"
        fill = f"background:linear-gradient(to right,#4772b3 {share},#454545 {share})"
        style = f' style="{fill}"' if item["share"] else ""
        return (
            f'<div class="number"{style}><span>{text["number"]}</span>'
            f"<span>{text['value']}</span></div>"
        )
    value = text["value"] or "&nbsp;"
    return f'<div class="field"><span>{text["field"]}</span><span>{value}</span></div>'


if __name__ == "__main__":
    main()
