"""Draw docs/house.svg, the layers of the package: ``python docs/make_house.py``.

The rows are those of the import contract in pyproject.toml; the line in a box is the first of its
module's docstring. The numbers are those of the steps in docs/architecture.md.
"""

import ast
import re
import textwrap
import tomllib
from html import escape
from pathlib import Path

ROOT = Path(__file__).parents[1]
WIDTH, ROW, GAP, MARGIN = 1180, 58, 8, 12
BANDS = {  # first module of a row: the band that begins there, and its colour
    "__main__": ("commands", "#e8eef7"),
    "pipeline": ("the order of work", "#dfe9f5"),
    "figures": ("files", "#fbe9d7"),
    "shot": ("jobs on arrays", "#e3f2e1"),
    "expression_system": ("computation", "#f3e8f5"),
    "rigs": ("types", "#f4f1de"),
    "options": ("ground", "#eeeeee"),
}


def picture() -> str:
    """Return the picture as SVG."""
    rows = [row.split(" | ") for row in _layers()]
    steps = _steps()
    boxes, y, colour = [], MARGIN, "#ffffff"
    for row in rows:
        for module in row:
            if module in BANDS:
                name, colour = BANDS[module]
                y += 18
                boxes.append(_text(MARGIN, y - 5, name, size=12, style="italic"))
        each = (WIDTH - 2 * MARGIN - GAP * (len(row) - 1)) / len(row)
        for column, module in enumerate(row):
            x, number = MARGIN + column * (each + GAP), ", ".join(steps.get(module, []))
            boxes += _box(module, number, x, y, each, colour)
        y += ROW + GAP
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{y + MARGIN}" '
        f'viewBox="0 0 {WIDTH} {y + MARGIN}" font-family="sans-serif">'
    )
    ground = '<rect width="100%" height="100%" fill="#ffffff"/>'
    return "\n".join([head, ground, *boxes, "</svg>"]) + "\n"


def _layers() -> list[str]:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    contracts = project["tool"]["importlinter"]["contracts"]
    layers: list[str] = next(c["layers"] for c in contracts if c["type"] == "layers")
    return layers


def _steps() -> dict[str, list[str]]:
    """Return the numbers of the steps of a shot, by the module that the page names first."""
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    steps: dict[str, list[str]] = {}
    for number, module in re.findall(r"^(\d)\. `(\w+)/", page, re.MULTILINE):
        steps.setdefault(module, []).append(number)
    return steps


def _box(module: str, number: str, x: float, y: float, width: float, colour: str) -> list[str]:
    folder = (ROOT / "usdface" / module).is_dir()
    lines = textwrap.wrap(_summary(module), max(12, int(width / 6.3)))[:2]
    parts = [
        f'<rect x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{ROW}" rx="6" '
        f'fill="{colour}" stroke="#666666" stroke-width="{1.6 if folder else 0.8}"/>',
        _text(x + 8, y + 18, module + ("/" if folder else ""), size=14, weight="bold"),
    ]
    parts += [_text(x + 8, y + 35 + 14 * i, line, size=11) for i, line in enumerate(lines)]
    if number:
        parts.append(_text(x + width - 8, y + 18, number, size=15, weight="bold", end=True))
    return parts


def _summary(module: str) -> str:
    path = ROOT / "usdface" / module
    file = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    text = ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))) or ""
    return text.split("\n")[0].replace("``", "").replace("`", "")


def _text(
    x: float,
    y: float,
    text: str,
    *,
    size: int,
    weight: str = "normal",
    style: str = "normal",
    end: bool = False,
) -> str:
    anchor, fill = ("end", "#b3261e") if end else ("start", "#222222")
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size}" font-weight="{weight}" '
        f'font-style="{style}" text-anchor="{anchor}" fill="{fill}">{escape(text)}</text>'
    )


if __name__ == "__main__":
    Path(__file__).with_name("house.svg").write_text(picture(), encoding="utf-8")
