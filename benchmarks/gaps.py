"""Errors by occluded markers: `python -m benchmarks.gaps`.

Takes of other people, through files, whole and with gaps over their
movements: single markers, all markers of mouth and jaw, all markers of the eyes, whole frames.
The error of the weights [skin, mm] in the frames of the gaps, and the largest step of a marker's
vertex from one frame to the next at a gap's edges, by that of the whole take there. Beside ours the
same solve of markers interpolated in time before it. See README.md.
"""

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from benchmarks.performers.solvers import ours, write_character
from benchmarks.performers.worlds import BUILT_WITH, JUDGED_ON, SKIN, Performance, Row, perform
from benchmarks.solve.faces import ROOT, Face, ict
from usdface.arrays import BoolArray, FloatArray
from usdface.geometry.gap_interpolation import interpolate_gaps

DATA = ROOT.parent / "shared" / "data"
PART = slice(2915, 3215)  # 10 s of the recorded curves
# Of the 68 landmarks (iBUG numbering).
MOUTH = (*range(3, 14), *range(48, 68))
EYES = tuple(range(36, 48))
ROW = Row("another person")
EVERY = 2.0  # s, from the start of a gap to the next


def hidden(name: str, frames: int, first: int, length: float, rate: float) -> BoolArray:
    """Return which markers are occluded in a take: (frames, 68)."""
    gaps = np.zeros((frames, 68), dtype=bool)
    rng = np.random.default_rng(frames)
    count = max(1, round(length * rate))
    for start in range(first + 30, frames - count - 10, round(EVERY * rate)):
        markers = {
            "a tenth of the markers": rng.choice(68, 7, replace=False),
            "mouth and jaw": np.array(MOUTH),
            "eyes": np.array(EYES),
            "all": np.arange(68),
        }[name]
        gaps[start : start + count, markers] = True
    return gaps


GAPS = ("a tenth of the markers", "mouth and jaw", "eyes", "all")
LENGTHS = (0.17, 1.0)  # s


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--end", action="store_true", help="performers 5 to 8, not 1 to 4")
    parser.add_argument("--noise", type=float, default=0.3, metavar="MM")
    parsed = parser.parse_args()
    numbers, face = JUDGED_ON if parsed.end else BUILT_WITH, ict(DATA)
    table = Table(title=f"skin error mm; step, {parsed.noise:g} mm of noise, performers {numbers}")
    for column in ("occluded", "length s", "no gap", "gap", "interpolated"):
        table.add_column(column, justify="right")
    table.add_column("step, whole take mm", justify="right")
    table.add_column("gap", justify="right")
    table.add_column("interpolated", justify="right")
    with tempfile.TemporaryDirectory() as folder:
        character = write_character(face, Path(folder))
        takes = [perform(DATA, n, ROW, part=PART, noise=parsed.noise / 1000) for n in numbers]
        whole = [ours(take, face, character) for take in track(takes, transient=True)]
        for name in GAPS:
            for length in LENGTHS:
                rows = [
                    measured(take, weights, face, character, name, length)
                    for take, weights in zip(takes, whole, strict=True)
                ]
                means = np.mean(rows, axis=0)
                table.add_row(name, f"{length:g}", *(f"{value:.2f}" for value in means))
    Console(width=140).print(table)


def measured(
    take: Performance, whole: FloatArray, face: Face, character: Path, name: str, length: float
) -> list[float]:
    """Return errors and steps [mm] without gaps, with gaps, and with interpolated markers."""
    gaps = hidden(name, len(take.positions), take.neutral_frames, length, face.rate)
    blank = take.positions.copy()
    blank[gaps] = np.nan
    times = np.arange(len(blank)) / face.rate
    flat, out = blank.reshape(len(blank), -1), np.repeat(gaps, 3, axis=1)
    filled = interpolate_gaps(flat, out, times).reshape(blank.shape)
    solved = [whole] + [
        ours(replace(take, positions=positions), face, character) for positions in (blank, filled)
    ]
    inside = gaps[take.neutral_frames :].any(axis=1)
    edges = inside[1:] != inside[:-1]
    skin = face.mesh.offsets_at(np.arange(SKIN)).reshape(len(face.mesh.shapes), -1)
    errors = [1000 * rms((weights - take.truth)[inside] @ skin) for weights in solved]
    at = face.offsets.reshape(len(face.offsets), -1)
    steps = [
        1000 * np.linalg.norm((np.diff(w, axis=0)[edges] @ at).reshape(edges.sum(), -1, 3), axis=2)
        for w in solved
    ]
    return [*errors, *(float(step.max()) for step in steps)]


def rms(displacements: FloatArray) -> float:
    """Return the RMS length of a vertex's displacement."""
    return float(np.sqrt(3 * np.mean(displacements**2)))


if __name__ == "__main__":
    main()
