"""Figures that the constants of `usdface/retarget` are judged by: see sensitivity.py.

Weight RMS error on four takes with known weights (second half of the recorded curves, on which
nothing was tuned; 0.3 mm of noise, turning head), and the stated standard deviations over the
true errors' on the first of them.
"""

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))
sys.path.insert(0, str(ROOT / "tests"))
from benchmarks.solve.faces import bent, ict, makehuman  # noqa: E402
from benchmarks.solve.table import ours, rms  # noqa: E402
from benchmarks.solve.worlds import PERFORMER, SCORED, World, perform  # noqa: E402

DATA = ROOT.parent / "shared" / "data"
FRAMES = slice(SCORED.start, SCORED.start + 300)


def takes() -> Iterator[World]:
    face = ict(DATA)
    yield perform("ICT", face, head_moves=True, part=FRAMES)
    yield perform("24 markers", ict(DATA, 24), head_moves=True, part=FRAMES)
    yield perform("other performer", face, performer=bent(face, 5, PERFORMER), seed=5, part=FRAMES)
    yield perform("MakeHuman", makehuman(DATA), head_moves=True, part=FRAMES)


def figures() -> dict[str, float]:
    """Return the figures by name."""
    found: dict[str, float] = {}
    for world in takes():
        weights, deviations = ours(world)
        off = weights - world.truth
        found[world.name] = rms(off)
        if "sd" not in found:
            found["sd"] = rms(deviations) / rms(off)
    return found


if __name__ == "__main__":
    np.set_printoptions(precision=4)
    print({name: round(value, 4) for name, value in figures().items()})
