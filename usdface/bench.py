"""The benchmark of the solve, from a checkout: `usdface bench solve`.

The other solvers and the takes of known weights are in `benchmarks/` beside the package, which an
installation does not have.
"""

import json
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

from usdface.errors import InputError
from usdface.io.atomic import write_text

__all__ = ["print_solve_table", "solve_table"]

CHECKOUT = Path(__file__).resolve().parents[1]
DATA = CHECKOUT.parent / "shared" / "data"


def solve_table(data: Path | None = None, quick: bool = False) -> dict[str, Any]:
    """Measure our solve and others on takes of known weights; plain values for JSON.

    Parameters
    ----------
    data : Path, optional
        Folder of the real data; `shared/data` beside the checkout, if left out. Where there is
        none, the example's head plays its own curves.
    quick : bool
        Short takes.

    Raises
    ------
    InputError
        If this is no checkout, or `data` has not what is needed.
    """
    if not (CHECKOUT / "benchmarks" / "solve").is_dir():
        raise InputError(
            f"bench solve needs a checkout of usdface: there is no benchmarks/solve beside "
            f"{CHECKOUT / 'usdface'}; clone the repository and run it there"
        )
    if str(CHECKOUT) not in sys.path:
        sys.path.insert(0, str(CHECKOUT))
    if data is not None and not import_module("benchmarks.solve.faces").has_real_data(data):
        raise InputError(
            f"{data} has no range-of-motion curves and no ICT face; expected the folders "
            "livelinkface and ict_facekit, or leave --data out to play the example"
        )
    table: dict[str, Any] = import_module("benchmarks.solve.table").measured(data or DATA, quick)
    return table


def print_solve_table(table: dict[str, Any], form: str, report: Path | None) -> None:
    """Print one line for each take: the weight RMS error of every solver, then ours in detail."""
    text = json.dumps(table, indent=1)
    if report:
        write_text(report, text + "\n")
    if form == "json":
        print(text)
        return
    from rich.box import SIMPLE
    from rich.console import Console
    from rich.table import Table

    names = list(table["rows"][0]["solvers"])
    shown = Table(title=f"weight RMS error; {table['curves']}", box=SIMPLE)
    detail = (
        "roughness / true",
        "mesh mm",
        "marker mm",
        "lip gap mm",
        "sd said / true",
        "within 1 sd",
        "within 2 sd",
    )
    for name in ("take", *names, *(f"ours: {name}" for name in detail), "best"):
        shown.add_column(name, justify="left" if name in ("take", "best") else "right")
    for row in table["rows"]:
        found = row["solvers"]
        errors = (f"{found[n]['weight rms']:.4f}" if n in found else "-" for n in names)
        ours = (f"{found['ours'][n]:.2f}" if n in found["ours"] else "-" for n in detail)
        shown.add_row(row["world"], *errors, *ours, row["best"])
    differ: dict[str, float] = {}
    for row in table["rows"]:
        for name, found in row["solvers"].items():
            if "from exact" in found:
                differ[name] = max(differ.get(name, 0.0), found["from exact"])
    if differ:
        said = ", ".join(f"{name} {most:.0e}" for name, most in differ.items())
        shown.caption = f"the same problem as exact; largest difference of a weight: {said}"
    Console(width=230).print(shown)
