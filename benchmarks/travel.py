"""Travel ratios of real takes, and the part of each term in them: `python benchmarks/travel.py`.

The travel of the character's skin by that of the performer's markers, by region, as the solve is
and with one part of it changed at a time. See README.md.
"""

import argparse
import sys
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))
import usdface  # noqa: E402
from benchmarks.pictures.shots import HEADS, played  # noqa: E402
from usdface.face.regions import REGIONS  # noqa: E402
from usdface.retarget.travel import Travel, region_travel  # noqa: E402
from usdface.shot.shot import Shot  # noqa: E402


def with_solve(**settings: object) -> Callable[[Shot], Shot]:
    def changed(shot: Shot) -> Shot:
        solve = replace(shot.setup.solve, **settings)  # type: ignore[arg-type]
        return replace(shot, setup=replace(shot.setup, solve=solve))

    return changed


def with_similarity(shot: Shot) -> Shot:
    space = usdface.MapOptions(choice="fixed", smoothing=1e12)
    return replace(shot, setup=replace(shot.setup, map=space))


CHANGES: dict[str, Callable[[Shot], Shot]] = {
    "as it is": lambda shot: shot,
    "hardly a ridge": with_solve(spread=50.0),
    "each frame alone": with_solve(mode="frame"),
    "prior not learned": with_solve(prior="fixed"),
    "similarity for a map": with_similarity,
    "both: similarity, hardly a ridge": lambda s: with_similarity(with_solve(spread=50.0)(s)),
}


def travels(shot: Shot) -> tuple[dict[str, Travel], float, float]:
    """Return the travel of each region, the mean residual [mm] and the mean sum of weights."""
    result = usdface.retarget(
        shot, options=usdface.ProcessOptions(express=False, head=False, clean=False)
    )
    solution = result.solution
    assert solution is not None and isinstance(shot.take, usdface.MarkerTake)
    weights = solution.weights.weights
    (found,) = region_travel(shot.face, shot.take, solution, weights, str)
    return found, 1000.0 * solution.residual.mean(), weights.sum(axis=1).mean()


def cell(travel: Travel | None) -> str:
    if travel is None or np.isnan(travel.ratio):
        return ""
    return f"{travel.ratio:.2f} ({travel.correlation:.2f})"


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split(":")[0])
    parser.add_argument("--heads", nargs="+", choices=HEADS, default=list(HEADS))
    heads = parser.parse_args().heads
    table = Table(title="Travel of the skin by travel of the markers (correlation)")
    for column in ("take", "solve", *REGIONS, "residual mm", "weights"):
        table.add_column(column)
    with tempfile.TemporaryDirectory() as folder:
        for take, head, result in played(("jaw", "eyebrows"), heads, Path(folder)):
            for label, change in CHANGES.items():
                found, residual, weights = travels(change(result.shot))
                cells = (cell(found.get(region)) for region in REGIONS)
                table.add_row(f"{take}, {head}", label, *cells, f"{residual:.2f}", f"{weights:.1f}")
    Console(width=170).print(table)


if __name__ == "__main__":
    main()
