"""Printing the published tables beside the computed ones: `usdface bench papers`."""

from typing import TYPE_CHECKING

from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

from usdface.cli.report import print_whole

if TYPE_CHECKING:
    from usdface.papers import PaperTable

__all__ = ["print_papers"]


def print_papers(tables: "list[PaperTable]") -> None:
    """Print each published figure beside the computed one."""
    console = Console(highlight=False)
    for paper in tables:
        kept = "kept" if paper.within else "NOT KEPT"
        caption = (
            f"{paper.legible} published figures: RMS difference {paper.rms:.4f}, "
            f"largest {paper.largest:.4f}; promise: {paper.promise} ({kept})"
        )
        table = Table(title=f"{paper.title}: published | computed", caption=caption, box=SIMPLE)
        table.add_column("", no_wrap=True)
        for name in paper.columns:
            table.add_column(name, justify="right", no_wrap=True)
        for name, published, ours in zip(paper.rows, paper.published, paper.computed, strict=True):
            pairs = zip(published, ours, strict=True)
            table.add_row(name, *(f"{'?' if p != p else f'{p:.2f}'}|{o:.3f}" for p, o in pairs))
        print_whole(console, table)
