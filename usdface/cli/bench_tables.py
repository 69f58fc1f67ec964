"""What `usdface bench` prints for people: published tables beside ours, our solve beside others."""

from typing import TYPE_CHECKING, Any

from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

from usdface.cli.report import print_whole

if TYPE_CHECKING:
    from usdface.papers import PaperTable

__all__ = ["print_solve_table", "print_tables"]


def print_tables(tables: "list[PaperTable]") -> None:
    """Print re-computed tables beside the published figures."""
    console = Console(highlight=False)
    for paper in tables:
        kept = "kept" if paper.within else "NOT KEPT"
        caption = (
            f"{paper.legible} published figures: RMS difference {paper.rms:.4f}, "
            f"largest {paper.largest:.4f}; promise: {paper.promise} ({kept})"
        )
        table = Table(title=f"{paper.title}: published | ours", caption=caption, box=SIMPLE)
        table.add_column("", no_wrap=True)
        for name in paper.columns:
            table.add_column(name, justify="right", no_wrap=True)
        for name, published, ours in zip(paper.rows, paper.published, paper.computed, strict=True):
            pairs = zip(published, ours, strict=True)
            table.add_row(name, *(f"{'?' if p != p else f'{p:.2f}'}|{o:.3f}" for p, o in pairs))
        print_whole(console, table)


def print_solve_table(table: dict[str, Any]) -> None:
    """Print one line for each take: the weight RMS error of every solver, then ours in detail."""
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
