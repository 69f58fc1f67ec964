"""Our solve beside others on takes of known weights: `python -m benchmarks.solve --help`."""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

from benchmarks.solve.faces import ROOT, has_real_data
from benchmarks.solve.table import measured

__all__ = ["main", "print_table"]

DATA = ROOT.parent / "shared" / "data"
DETAILS = {
    "roughness / true": "roughness / true",
    "mesh mm": "mesh mm",
    "marker mm": "marker mm",
    "lip gap mm": "lip gap mm",
    "stated sd / true": "sd said / true",
    "within 1 sd": "within 1 sd",
    "within 2 sd": "within 2 sd",
}


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.solve", description=(__doc__ or "").split(":")[0]
    )
    parser.add_argument(
        "--data",
        type=Path,
        metavar="DIR",
        help="real data (default: ../shared/data, else the example)",
    )
    parser.add_argument("--quick", action="store_true", help="short takes")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the table as JSON")
    parsed = parser.parse_args()
    if parsed.data and not has_real_data(parsed.data):
        sys.exit(
            f"{parsed.data} has no range-of-motion curves and no ICT face; expected the folders "
            "livelinkface and ict_facekit, or leave --data out"
        )
    table = measured(parsed.data or DATA, parsed.quick)
    print_table(table)
    if parsed.json:
        parsed.json.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")


def print_table(table: dict[str, Any]) -> None:
    """Print one line for each take: the weight RMS error of every solver, then ours in detail."""
    names = list(table["rows"][0]["solvers"])
    shown = Table(title=f"weight RMS error; {table['curves']}", box=SIMPLE)
    for name in ("take", *names, *(f"ours: {name}" for name in DETAILS), "best"):
        shown.add_column(name, justify="left" if name in ("take", "best") else "right")
    for row in table["rows"]:
        found = row["solvers"]
        errors = (f"{found[n]['weight rms']:.4f}" if n in found else "-" for n in names)
        ours = found["ours"]
        detail = (f"{ours[key]:.2f}" if key in ours else "-" for key in DETAILS.values())
        shown.add_row(row["world"], *errors, *detail, row["best"])
    differ: dict[str, float] = {}
    for row in table["rows"]:
        for name, found in row["solvers"].items():
            if "from exact" in found:
                differ[name] = max(differ.get(name, 0.0), found["from exact"])
    if differ:
        largest = ", ".join(f"{name} {most:.0e}" for name, most in differ.items())
        shown.caption = f"the same problem as exact; largest difference of a weight: {largest}"
    Console(width=230).print(shown)


if __name__ == "__main__":
    main()
