"""Printing feature points from images beside the paper's: `usdface bench papers --images`."""

from typing import TYPE_CHECKING

import numpy as np
from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

from usdface.arrays import FloatArray
from usdface.cli.report import print_whole, shown

if TYPE_CHECKING:
    from usdface.papers.image_points import ImagePoints

__all__ = ["print_image_points"]


def print_image_points(result: "ImagePoints") -> None:
    """Print the quantities of Table I of the RBF paper by each way, and their errors."""
    console = Console(highlight=False)
    print_whole(console, _points(result))
    if result.errors:
        print_whole(console, _scores(result))


def _points(result: "ImagePoints") -> Table:
    table = Table(
        title=f"Feature points of frame {result.test_frame}, Table I of the RBF paper",
        caption=f"multiquadric kernel, r = {result.radius:.2f} px",
        box=SIMPLE,
    )
    table.add_column("marker", no_wrap=True)
    for name in ("neutral [px]", "frame [px]", "neutral [mm]"):
        table.add_column(shown(name), justify="right", no_wrap=True)
    for name in result.points:
        table.add_column(shown(f"{name} [mm]"), justify="right", no_wrap=True)
    for name in result.errors:
        table.add_column(shown(f"off, {name} [mm]"), justify="right", no_wrap=True)
    for row, marker in enumerate(result.markers):
        table.add_row(
            shown(marker),
            _cells(result.train_source[row], 1),
            _cells(result.test_source[row], 1),
            _cells(1000 * result.train_target[row], 1),
            *(_cells(1000 * points[row], 2) for points in result.points.values()),
            *(_cells(1000 * error[row], 2) for error in result.errors.values()),
        )
    return table


def _scores(result: "ImagePoints") -> Table:
    table = Table(title="Errors of each way", box=SIMPLE)
    table.add_column("way", no_wrap=True)
    columns = ("frame, RMS [mm]", "largest [mm]", "film, RMS [mm]", "weights, RMS")
    for name in columns:
        table.add_column(shown(name), justify="right", no_wrap=True)
    for score in result.scores:
        numbers = (score.frame, score.largest, score.film)
        table.add_row(score.name, *(_cells(n, 2) for n in numbers), _cells(score.weights, 3))
    return table


def _cells(values: "FloatArray | float", digits: int) -> str:
    return " ".join("-" if v != v else f"{v:.{digits}f}" for v in np.atleast_1d(values).tolist())
