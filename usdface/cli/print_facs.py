"""Printing verdicts by action units: `usdface check --facs`."""

from collections.abc import Iterable, Mapping
from typing import Any

from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

from usdface.cli.report import print_whole, shown

__all__ = ["print_facs"]

_VERDICTS = {
    "done": ("done", "green"),
    "dead": ("DEAD", "red"),
    "other_side": ("OTHER SIDE", "red"),
    "swapped": ("SWAPPED", "red"),
    "other_unit": ("OTHER UNIT", "red"),
    "mixed": ("MIXED", "red"),
    "not_done": ("NOT DONE", "red"),
    "unnamed": ("no unit named", "dim"),
}


def print_facs(files: Iterable[Mapping[str, Any]]) -> None:
    """Print the verdicts on each file: its blend shapes, its poses, the peaks of its take."""
    console = Console(highlight=False)
    for verdicts in files:
        if "shapes" not in verdicts:
            continue
        noise = verdicts["noise_mm"]
        title = f"{verdicts['file']}: blend shapes by action units (noise {noise:g} mm)"
        print_whole(console, _shapes(title, verdicts["shapes"]))
        if verdicts["poses"]:
            print_whole(console, _poses(verdicts["poses"]))
        if verdicts["peaks"]:
            print_whole(console, _peaks(verdicts["peaks"]))


def _table(title: str, left: Iterable[str], right: Iterable[str]) -> Table:
    table = Table(title=shown(title), box=SIMPLE, title_justify="left")
    for name in left:
        table.add_column(shown(name), no_wrap=True)
    for name in right:
        table.add_column(shown(name), justify="right", no_wrap=True)
    table.add_column("verdict", no_wrap=True)
    return table


def _shapes(title: str, rows: Iterable[Mapping[str, Any]]) -> Table:
    table = _table(title, ("blend shape", "unit"), ("moved [mm]", "in noise", "fit"))
    for row in rows:
        word, style = _VERDICTS[row["verdict"]]
        about = {
            "other_side": f": {row['shown']}",
            "swapped": f" with {row['partner']}",
            "other_unit": f": {row['shown']}",
            "mixed": f": {row['shown']} and {row['second']}",
        }.get(row["verdict"], "")
        if row["verdict"] == "unnamed" and row["shown"]:
            about = f", most like {row['shown']}"
        numbers = (f"{row['moved_mm']:.1f}", f"{row['in_noise']:.0f}", f"{row['fit']:.2f}")
        table.add_row(
            *(shown(row["shape"]), row["unit"] or "-"),
            *(numbers if row["unit"] else ("", "", "")),
            shown(word + about),
            style=style if row["verdict"] != "done" else None,
        )
    return table


def _poses(rows: Iterable[Mapping[str, Any]]) -> Table:
    table = _table("expression poses: displacement of each unit [mm]", ("pose", "units"), ())
    for row in rows:
        others = [f"AU{other['unit']} moves besides" for other in row["others"]]
        verdict = ", ".join([*_not_done(row), *others]) or ("done" if row["units"] else "-")
        if row["criteria"] is not None:
            verdict += "; criteria of the paper " + ("met" if row["criteria"] else "NOT MET")
        table.add_row(shown(row["pose"]), _amounts(row), shown(verdict))
    return table


def _peaks(rows: Iterable[Mapping[str, Any]]) -> Table:
    title = "peaks of the take: displacement of each unit at the markers / solved / corrected [mm]"
    table = _table(title, ("emotion", "time [s]", "units"), ())
    for row in rows:
        each = (row[at]["units"] for at in ("markers", "solved", "corrected"))
        units = "  ".join(
            f"{one['unit']}: " + "/".join(f"{u['moved_mm']:.1f}" for u in (one, two, three))
            for one, two, three in zip(*each, strict=True)
        )
        lost = [f"AU{unit} lost" for unit in row["lost"]]
        table.add_row(
            *(shown(row["emotion"]), f"{row['time_s']:.2f}", units),
            ", ".join([*lost, *_not_done(row["markers"], " at the markers")]) or "done",
        )
    return table


def _amounts(row: Mapping[str, Any]) -> str:
    return "  ".join(f"{unit['unit']}: {unit['moved_mm']:.1f}" for unit in row["units"])


def _not_done(row: Mapping[str, Any], where: str = "") -> list[str]:
    missing = [f"AU{u['unit']}" for u in row["units"] if u["verdict"] != "done"]
    return [f"{' '.join(missing)} not done{where}"] if missing else []
