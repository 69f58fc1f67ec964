"""Recovery of known weights of other people: `python -m benchmarks.performers`.

Each solver's weight RMS error, and the RMS error of the character's skin [mm], in the mean of four
performers. The solve was built with performers 1 to 4; 5 to 8 judge it. See README.md.
"""

import argparse
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from benchmarks.performers.bad_tracks import TRACKS, with_tracks
from benchmarks.performers.given_values import errors_with_given_values
from benchmarks.performers.other_heads import OTHER_HEADS, neutrals_on
from benchmarks.performers.shown_neutral import NEUTRALS, with_neutral
from benchmarks.performers.solvers import (
    FILTERED,
    SOLVERS,
    make_shot,
    processed,
    write_character,
)
from benchmarks.performers.unknown_strengths import errors_by_strength
from benchmarks.performers.worlds import (
    BUILT_WITH,
    JUDGED_ON,
    ROWS,
    SKIN,
    Performance,
    perform,
    strengths_of,
)
from benchmarks.solve.faces import ROOT, Face, has_real_data, ict
from usdface.arrays import FloatArray

DATA = ROOT.parent / "shared" / "data"
FRESH = (9, 10, 11, 12)
GIVEN = (1, 3)


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.performers", description=(__doc__ or "").split(":")[0]
    )
    parser.add_argument("--built-with", action="store_true", help="performers 1 to 4, not 5 to 8")
    parser.add_argument(
        "--unknown-strengths", action="store_true", help="what strengths that are not known cost"
    )
    parser.add_argument(
        "--given",
        action="store_true",
        help="errors with true values in parts of the performer's file; 10 s",
    )
    parser.add_argument(
        "--neutrals", action="store_true", help="takes whose neutral frames show something; 20 s"
    )
    parser.add_argument(
        "--other-heads",
        action="store_true",
        help="neutral weights that are found on characters of another model; 20 s",
    )
    parser.add_argument(
        "--tracks", action="store_true", help="takes in which some markers are off; 20 s"
    )
    parser.add_argument("--data", type=Path, default=DATA, metavar="DIR")
    parsed = parser.parse_args()
    if not has_real_data(parsed.data):
        sys.exit(f"{parsed.data} has no range-of-motion curves and no ICT face")
    numbers = BUILT_WITH if parsed.built_with else JUDGED_ON
    face = ict(parsed.data)
    if parsed.unknown_strengths:
        print_unknown_strengths(face)
        return
    if parsed.neutrals:
        print_neutrals(parsed.data, face, numbers)
        return
    if parsed.other_heads:
        print_other_heads(parsed.data, face, numbers)
        return
    if parsed.tracks:
        print_tracks(parsed.data, face, numbers)
        return
    if parsed.given:
        print_given(parsed.data, face)
        return
    names = ", ".join(str(number) for number in numbers)
    table = Table(title=f"weight RMS error / skin \\[mm], performers {names}")
    for column in ("take", *SOLVERS):
        table.add_column(column, justify="right")
    with tempfile.TemporaryDirectory() as folder:
        character = write_character(face, Path(folder))
        for row in ROWS:
            errors: dict[str, list[tuple[float, float]]] = {name: [] for name in SOLVERS}
            for number in track(numbers, row.name, transient=True):
                performance = perform(parsed.data, number, row)
                for name, solve in SOLVERS.items():
                    off = solve(performance, face, character) - performance.truth
                    errors[name].append((rms(off), 1000 * skin_error(face, off)))
            means = (np.mean(of, axis=0) for of in errors.values())
            table.add_row(row.name, *(f"{weight:.4f} / {skin:.3f}" for weight, skin in means))
    Console(width=180).print(table)


def print_unknown_strengths(face: Face) -> None:
    """Print the errors of solvers that know all but the strengths; no take is solved."""
    table = Table(title="weight RMS error / skin \\[mm]")
    table.add_column("performers", justify="right")
    for numbers in (BUILT_WITH, JUDGED_ON, FRESH):
        found = [errors_by_strength(face, number) for number in numbers]
        if not table.rows:
            for name in found[0]:
                table.add_column(name, justify="right")
        table.add_row(", ".join(str(number) for number in numbers), *mean_cells(face, found))
    Console().print(table)


def print_given(data: Path, face: Face) -> None:
    """Print errors of 10 s of two performers, with more and more true values in a file of 20 s."""
    table = Table(title="weight RMS error / skin \\[mm], performers 1, 3")
    with tempfile.TemporaryDirectory() as folder:
        character = write_character(face, Path(folder))
        for row in ROWS[:2]:
            found = []
            for number in GIVEN:
                other = perform(data, number, row, part=slice(0, 600))
                performance = perform(data, number, row, part=slice(*ROWS[3].part))
                performance = replace(performance, other=other)
                count = len(face.mesh.shapes)
                strengths = strengths_of(number, count) if row.strengths else np.ones(count)
                found.append(errors_with_given_values(performance, face, character, strengths))
            if not table.columns:
                for column in ("take", *found[0]):
                    table.add_column(column, justify="right")
            table.add_row(row.name, *mean_cells(face, found))
    Console(width=200).print(table)


def print_neutrals(data: Path, face: Face, numbers: Sequence[int]) -> None:
    """Print errors of takes whose neutral frames show something, in the mean of performers."""
    takes = {
        name: [with_neutral(data, number, name, face.mesh.shape_names) for number in numbers]
        for name in NEUTRALS
    }
    settings = {"as they are": {"neutral": "given"}, "weights found": {}}
    print_settings("the neutral shows", face, numbers, takes, settings)


def print_other_heads(data: Path, face: Face, numbers: Sequence[int]) -> None:
    """Print the neutral weights found on other heads, for each performer."""
    names = ", ".join(str(number) for number in numbers)
    table = Table(title=f"neutral weights found, performers {names}")
    for column in ("head", "the neutral shows", *map(str, numbers)):
        table.add_column(column)
    for head in OTHER_HEADS:
        for shows in ("nothing", "mouth open 0.1", "drawn"):
            found = neutrals_on(head, data, face, numbers, shows)
            cells = [", ".join(f"{n} {w:.2f}" for n, w in each.items()) or "-" for each in found]
            table.add_row(head, shows, *cells)
    Console(width=180).print(table)


def print_tracks(data: Path, face: Face, numbers: Sequence[int]) -> None:
    """Print errors of takes in which some markers are off, in the mean of performers."""
    takes = {name: [with_tracks(data, number, name, face) for number in numbers] for name in TRACKS}
    settings = {"all count alike": {"errors": "alike"}, "errors found": {}}
    print_settings("markers that are off", face, numbers, takes, settings)


def print_settings(
    what: str,
    face: Face,
    numbers: Sequence[int],
    takes: dict[str, list[Performance]],
    settings: dict[str, dict[str, str]],
) -> None:
    """Print the errors of takes by settings of the solve, and of least squares."""
    names = ", ".join(str(number) for number in numbers)
    table = Table(title=f"weight RMS error / skin \\[mm], performers {names}")
    for column in (what, *settings, FILTERED):
        table.add_column(column, justify="right")
    with tempfile.TemporaryDirectory() as folder:
        character = write_character(face, Path(folder))
        for name, performances in takes.items():
            found = [
                {
                    column: processed(make_shot(take, face, character, solve=solve), take, face)
                    - take.truth
                    for column, solve in settings.items()
                }
                | {FILTERED: SOLVERS[FILTERED](take, face, character) - take.truth}
                for take in performances
            ]
            table.add_row(name, *mean_cells(face, found))
    Console(width=160).print(table)


def mean_cells(face: Face, found: Sequence[dict[str, FloatArray]]) -> list[str]:
    """Return the mean errors of performers, by name."""
    cells = []
    for name in found[0]:
        errors = [(rms(of[name]), 1000 * skin_error(face, of[name])) for of in found]
        weight, skin = np.mean(errors, axis=0)
        cells.append(f"{weight:.4f} / {skin:.3f}")
    return cells


def rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def skin_error(face: Face, off: FloatArray) -> float:
    """Return the RMS distance [m] of the skin by weights that are off by `off` (F, S)."""
    offsets = face.mesh.offsets_at(np.arange(SKIN)).reshape(len(face.mesh.shapes), -1)
    squares = ((off @ (offsets @ offsets.T)) * off).sum(axis=1) / SKIN
    return float(np.sqrt(squares.mean()))


if __name__ == "__main__":
    main()
