"""Figures of whole takes for `benchmarks/regressions.py`, shorter than those of the tables.

Performers 1 and 3 and a film of 10 s, with which the solve was built: those that are kept for one
look stay so.
"""

import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))
from benchmarks import gaps, known_answer, one_camera  # noqa: E402
from benchmarks.performers.__main__ import rms, skin_error  # noqa: E402
from benchmarks.performers.solvers import ours, with_file, write_character  # noqa: E402
from benchmarks.performers.worlds import ROWS, perform  # noqa: E402
from benchmarks.solve.faces import bent, ict  # noqa: E402

DATA = ROOT.parent / "shared" / "data"
PERFORMERS = (1, 3)
# 10 s and 20 s of the recorded curves.
SHORT, OTHER = slice(2915, 3215), slice(0, 600)
SOLVERS = {"": ours, ", file": with_file}


def performer_figures() -> dict[str, float]:
    """Return the errors of other people's weights and skin, first take and with a file."""
    face, found = ict(DATA), {}
    with tempfile.TemporaryDirectory() as folder:
        character = write_character(face, Path(folder))
        for row in ROWS[:3]:
            takes = [
                replace(
                    perform(DATA, number, row, part=SHORT),
                    other=perform(DATA, number, row, part=OTHER),
                )
                for number in PERFORMERS
            ]
            for name, solve in SOLVERS.items():
                off = [solve(take, face, character) - take.truth for take in takes]
                found[row.name + name] = float(np.mean([rms(each) for each in off]))
                skin = np.mean([1000 * skin_error(face, each) for each in off])
                found[f"{row.name}{name}, skin mm"] = float(skin)
    return found


def known_answer_figures() -> dict[str, float]:
    """Return errors of weights that are known, 0.3 mm of noise, by those of exact frames."""
    face = ict(DATA)
    with tempfile.TemporaryDirectory() as folder:
        character = write_character(face, Path(folder))
        return known_answer.figures_of_takes(face, face.curves[SHORT], character)


def gap_figures() -> dict[str, float]:
    """Return the errors of the skin [mm] and the steps in gaps of a second, two performers."""
    face, found = ict(DATA), {}
    with tempfile.TemporaryDirectory() as folder:
        character = write_character(face, Path(folder))
        takes = [perform(DATA, number, gaps.ROW, part=SHORT) for number in PERFORMERS]
        whole = [ours(take, face, character) for take in takes]
        for name in ("mouth and jaw", "eyes", "all"):
            rows = [
                gaps.measured(take, weights, face, character, name, 1.0)
                for take, weights in zip(takes, whole, strict=True)
            ]
            _, skin, _, _, step, _ = np.mean(rows, axis=0).tolist()
            found |= {f"{name}, skin mm": skin, f"{name}, step mm": step}
    return found


def film_figures() -> dict[str, float]:
    """Return the errors of weights from one camera, 10 s, with markers at and beside vertices."""
    part, found = one_camera.PARTS["built with"], {}
    face = ict(DATA)
    face = replace(face, curves=face.curves[part.start :][: SHORT.stop - SHORT.start])
    beside = replace(face, points=one_camera.vertices_beside(face, one_camera.BESIDE, part.seed))
    another = bent(face, part.seed, one_camera.BEND)
    for who, performer in (("the character", face), ("another", another)):
        take, motion = one_camera.film(face, performer, 20.0, part)
        take = replace(take, focal_length=part.focal_length)
        found[who] = one_camera.error(face, take, motion)[0]
        found[f"{who}, beside"] = one_camera.error(beside, take, motion)[0]
    return found


if __name__ == "__main__":
    for measure in (performer_figures, known_answer_figures, gap_figures, film_figures):
        print({name: round(value, 4) for name, value in measure().items()})
