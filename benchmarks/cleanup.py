"""How well a take is cleaned up: `python benchmarks/cleanup.py`.

AnimFace's real optical takes, broken at random with fixed seeds: labels swapped for up to 2.5 s,
markers thrown off by 5 to 30 mm for up to 0.1 s, gaps of 0.1, 1 and 4 s in two markers at a time.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from usdface.arrays import BoolArray, FloatArray
from usdface.cleanup.clean import Cleaned, clean_take
from usdface.io.takes.files import read_take
from usdface.options import CleanOptions
from usdface.takes import MarkerTake

SHARED = Path(__file__).resolve().parents[1].parent / "shared" / "data"
TAKES = ("Jaw", "Eyebrows")
LENGTHS = (6, 60, 240)  # frames at 60 Hz
NOISE = 3e-4


def recorded(name: str) -> MarkerTake:
    take, _ = read_take(SHARED / "animface" / f"{name}.c3d")
    assert isinstance(take, MarkerTake)
    return take


def cleaned(take: MarkerTake) -> Cleaned:
    return clean_take(take, take.names, CleanOptions())[0]


def repaired(result: Cleaned, kind: str) -> BoolArray:
    """Return where repairs of a kind are: (F, M)."""
    where = np.zeros(result.measured.shape, dtype=bool)
    for repair in result.repairs:
        if repair.kind == kind:
            column = result.take.names.index(repair.marker)
            where[repair.first : repair.last + 1, column] = True
    return where


def broken(take: MarkerTake, seed: int) -> tuple[MarkerTake, dict[str, BoolArray]]:
    """Swap labels 15 times and throw markers off 40 times; also return where."""
    rng = np.random.default_rng(seed)
    positions: FloatArray = take.positions + NOISE * rng.normal(size=take.positions.shape)
    frames, count = positions.shape[:2]
    swaps, spikes, near = np.zeros((3, frames, count), dtype=bool)
    for kind, most, times in (("swap", 150, 15), ("spike", 6, 40)):
        for _ in range(times):
            length = rng.integers(1, most)
            first = rng.integers(5, frames - length - 5)
            who = rng.choice(count, 2 if kind == "swap" else 1, replace=False)
            rows, around = slice(first, first + length), slice(first - 2, first + length + 2)
            if near[around, who].any():
                continue
            near[around, who] = True
            if kind == "swap":
                positions[rows, who] = positions[rows, who[::-1]]
                swaps[rows, who] = True
            else:
                away = rng.normal(size=3)
                positions[rows, who] += away / np.linalg.norm(away) * rng.uniform(0.005, 0.03)
                spikes[rows, who] = True
    return replace(take, positions=positions), {"swap": swaps, "spike": spikes}


def gap_error(length: int, pairs: int = 3) -> float:
    """Return the mean error [mm] of filled gaps of `length` frames in `pairs` of markers a take."""
    rng, errors = np.random.default_rng(4), []
    for take in map(recorded, TAKES):
        for pair in rng.permutation(len(take.names))[: 2 * pairs].reshape(-1, 2):
            gap = np.zeros(take.visible.shape, dtype=bool)
            for marker in pair:
                first = rng.integers(5, len(gap) - length - 5)
                gap[first : first + length, marker] = True
            lost = np.where(gap[..., None], np.nan, take.positions)
            filled = cleaned(replace(take, positions=lost)).take.positions
            apart = np.linalg.norm(filled - take.positions, axis=2)[gap]
            errors.append(1000.0 * float(apart.mean()))  # NaN where a gap was left
    return float(np.mean(errors))


def figures() -> dict[str, float]:
    """Return precision and recall of swaps and spikes [%], and errors of filled gaps [mm]."""
    counts = {"swap": np.zeros(3), "spike": np.zeros(3)}
    for seed, name in enumerate(TAKES):
        take, truth = broken(recorded(name), 31 + seed)
        result = cleaned(take)
        for kind, where in truth.items():
            found = repaired(result, kind)
            counts[kind] += [(found & where).sum(), found.sum(), where.sum()]
    scores = {}
    for kind, (hits, found, true) in counts.items():
        scores[f"{kind} precision %"] = 100.0 * float(hits / max(found, 1.0))
        scores[f"{kind} recall %"] = 100.0 * float(hits / true)
    return scores | {f"gap {length / 60:g} s mm": gap_error(length, 1) for length in LENGTHS}


def gap_figures() -> dict[str, float]:
    """Return the errors of gaps in six pairs of markers [mm], as `main` prints them."""
    return {f"gap {length / 60:g} s mm": gap_error(length) for length in LENGTHS}


def main() -> None:
    table = Table("figure", "", title="a real optical take, cleaned up")
    for name, value in figures().items():
        table.add_row(name, f"{value:.3g}")
    for name, value in gap_figures().items():
        table.add_row(f"{name}, six pairs", f"{value:.3g}")
    Console().print(table)


if __name__ == "__main__":
    main()
