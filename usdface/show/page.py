"""The table of a sequence as a page: one HTML file that makes no request."""

from collections.abc import Sequence
from html import escape
from pathlib import Path
from urllib.parse import quote

from usdface.errors import OutputError
from usdface.io.relative_path import relative_path
from usdface.plain_text import plain
from usdface.show.table import Row

__all__ = ["check_page_name", "table_page"]

_LONGEST = 300  # characters of a cell
_WORDS = {"good": "good", "look_at": "look at", "not_usable": "not usable", "": "none"}
_STYLE = """
:root { color-scheme: light dark; font: 14px/1.4 system-ui, sans-serif; }
body { margin: 1.5rem; }
table { border-collapse: collapse; }
th, td { padding: .3rem .7rem; text-align: left; border-bottom: 1px solid #8884; }
th { position: sticky; top: 0; background: Canvas; }
td.n { text-align: right; font-variant-numeric: tabular-nums; }
tr.failed td, tr.not_usable td:nth-child(2) { color: #c22; font-weight: 600; }
tr.look_at td:nth-child(2) { color: #a60; font-weight: 600; }
tr.good td:nth-child(2) { color: #283; }
@media (prefers-color-scheme: dark) {
  tr.failed td, tr.not_usable td:nth-child(2) { color: #f77; }
  tr.look_at td:nth-child(2) { color: #db5; }
  tr.good td:nth-child(2) { color: #7c8; }
}
"""
_HEADS = (
    *("shot", "verdict", "frames", "residual mean [mm]", "worst [mm]", "occluded [%]"),
    *("largest correction", "findings", "run"),
)


def check_page_name(place: Path) -> None:
    """Refuse a page that is not named as one.

    Raises
    ------
    OutputError
        If its name does not end in .html or .htm.
    """
    if place.suffix.lower() not in (".html", ".htm"):
        raise OutputError(f"cannot write {place}: a page is HTML; end its name in .html")


def table_page(rows: Sequence[Row], title: str, place: Path) -> str:
    """Return the page of rows in their order; links are relative to its `place`."""
    counts = {state: sum(row.state == state for row in rows) for state in ("failed", "missing")}
    tally = ", ".join(f"{count} {state}" for state, count in counts.items() if count)
    head = "".join(f"<th>{name}</th>" for name in _HEADS)
    body = "\n".join(_row(row, place) for row in rows)
    return (
        "<!doctype html>\n"
        f'<html lang="en"><meta charset="utf-8"><title>{_text(title)}</title>\n'
        f'<meta http-equiv="Content-Security-Policy" content="default-src \'none\'; '
        "style-src 'unsafe-inline'\">\n"
        f"<style>{_STYLE}</style>\n<h1>{_text(title)}</h1>\n"
        f"<p>{len(rows)} shots{', ' if tally else ''}{tally}; the ones in most trouble first</p>\n"
        f"<table><thead><tr>{head}</tr></thead><tbody>\n{body}\n</tbody></table></html>\n"
    )


def _row(row: Row, place: Path) -> str:
    name = _text(row.name)
    if target := row.page or row.root:
        relative = Path(relative_path(Path(target), place.parent))
        link = relative.as_uri() if relative.is_absolute() else quote(relative.as_posix())
        name = f'<a href="{escape(link)}">{name}</a>'
    share = None if row.occluded_share is None else 100.0 * row.occluded_share
    numbers = (
        (str(row.frames) if row.frames else ""),
        *map(_number, (row.residual_mean_mm, row.residual_max_mm, share, row.correction_max)),
    )
    findings = ", ".join(
        f"{code} {count}" if count > 1 else code for code, count in row.findings.items()
    )
    lost = row.state in ("failed", "missing")
    verdict = row.state if lost else _WORDS.get(row.verdict, row.verdict)
    if row.reasons and not lost:
        verdict += f": {', '.join(row.reasons)}"
    why = f"{row.error} [{row.code}]" if row.error else findings
    cells = "".join(f'<td class="n">{number}</td>' for number in numbers)
    kind = row.state if lost else row.verdict
    return (
        f'<tr class="{_text(kind)}"><td>{name}</td><td>{_text(verdict)}</td>{cells}'
        f"<td>{_text(why)}</td><td>{_text(row.state)}</td></tr>"
    )


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.3g}"


def _text(text: str) -> str:
    return escape(plain(text, _LONGEST))
