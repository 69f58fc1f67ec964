"""Figures that became worse: `python benchmarks/regressions.py`.

Each function of `MEASURES` returns figures by name, of takes short enough to be measured after
every change of the solve, the binding or the expression layer; `benchmarks/figures.json` has them
as they were last kept. A table shows those that differ, and the command fails if there are any:
whether a change is a gain or a loss, and worth it, is for a reader to say. `--keep` writes them as
they are now, for a commit that says why they differ; `--only NAME` measures some.

The tables of docs/measurements.md and README.md come from longer takes and other performers.
"""

import argparse
import json
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from rich.console import Console
from rich.progress import track
from rich.table import Table
from sensitivity import Constant, measured

KEPT = Path(__file__).with_name("figures.json")
# Share of a figure by which it may differ: other processors round otherwise, and iterations end
# a step sooner or later.
TOLERANCE = 0.02
# "file:function" of benchmarks, as in sensitivity.py.
MEASURES = (
    "solve_figures:figures",
    "take_figures:performer_figures",
    "take_figures:known_answer_figures",
    "take_figures:gap_figures",
    "take_figures:film_figures",
    "calibration:figures",
    "cleanup:figures",
    "binding:named_figures",
    "binding:anchor_figures",
    "binding:neutral_figures",
    "expressions:layer_figures",
    "facs:figures",
    "closure_figures:figures",
    "footage_figures:figures",
)
Figures = dict[str, dict[str, float]]


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--only", nargs="+", metavar="NAME", help="measures with these words")
    parser.add_argument("--keep", action="store_true", help="write the figures as they are now")
    parsed = parser.parse_args()
    words = parsed.only or [""]
    chosen = [measure for measure in MEASURES if any(word in measure for word in words)]
    if not chosen:
        sys.exit(
            f"no measure has {' or '.join(words)} in its name; there are {', '.join(MEASURES)}"
        )
    kept: Figures = json.loads(KEPT.read_text(encoding="utf-8")) if KEPT.exists() else {}
    now = dict(zip(chosen, measure_all(chosen), strict=True))
    rows = list(differences(kept, now))
    if rows:
        table = Table("measure", "figure", "kept", "now")
        for row in rows:
            table.add_row(*row)
        Console(width=120).print(table)
    if parsed.keep:
        KEPT.write_text(json.dumps(rounded({**kept, **now}), indent=1) + "\n", encoding="utf-8")
    elif rows:
        sys.exit(f"{len(rows)} figures differ; --keep writes them as they are now")
    else:
        print(f"{sum(map(len, now.values()))} figures as they were kept")


def measure_all(measures: Sequence[str]) -> list[dict[str, float]]:
    """Measure in processes of their own, one for each core."""
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        found = pool.map(lambda measure: measured(Constant("", "", measure), 1.0), measures)
        return list(track(found, "measuring", total=len(measures), transient=True))


def differences(kept: Figures, now: Figures) -> Iterator[tuple[str, str, str, str]]:
    """Yield measure, figure, what was kept and what is measured, where these differ."""
    for measure, figures in now.items():
        before = kept.get(measure, {})
        for name in dict.fromkeys([*before, *figures]):
            if not alike(before.get(name), figures.get(name)):
                yield measure, name, text(before.get(name)), text(figures.get(name))


def alike(kept: float | None, now: float | None) -> bool:
    """Whether a figure is as it was."""
    return None not in (kept, now) and abs(now - kept) <= TOLERANCE * abs(kept)


def rounded(figures: Mapping[str, Mapping[str, float]]) -> Figures:
    """Return the figures with four digits: what follows is the processor's."""
    return {
        measure: {name: float(f"{value:.4g}") for name, value in of.items()}
        for measure, of in sorted(figures.items())
    }


def text(value: float | None) -> str:
    return "" if value is None else f"{value:.4g}"


if __name__ == "__main__":
    main()
