"""How fast the solve is, beside daqp: `python benchmarks/solve_speed.py`.

Frames a second of the exact solve of every frame and of the whole-take solve, on real
range-of-motion curves (ICT face, 68 landmarks, 0.3 mm of noise) and on random shapes. daqp is
called frame by frame, through qpsolvers and by itself; scipy's `lsq_linear` on a few frames.
All take turns, figures are medians. Needs the extra `bench`; see README.md.
"""

import argparse
import resource
import sys
import time
from collections.abc import Callable
from pathlib import Path
from unittest.mock import patch

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.optimize import lsq_linear

from usdface.arrays import FloatArray
from usdface.face.curve_mapping import rename_weights
from usdface.io.takes.files import read_take
from usdface.options import SolveOptions
from usdface.retarget.solver.bounded_least_squares import solve_bounded
from usdface.retarget.solver.regularisation import Regularisation
from usdface.retarget.solver.solve import solve_weights

ROOT = Path(__file__).resolve().parents[1]
SHARED = ROOT.parent / "shared" / "data"
sys.path.insert(0, str(ROOT / "tests"))
from ict_face import ict_mesh, landmarks  # noqa: E402

NOISE = 3e-4
USUAL = Regularisation(NOISE, 0.0, SolveOptions())
Run = Callable[[], object]


class Case:
    """Offsets D (S, N) and markers y (F, N), as normal matrix and right-hand sides."""

    def __init__(self, name: str, offsets: FloatArray, observed: FloatArray, rate: float) -> None:
        self.name, self.offsets, self.observed = name, offsets, observed
        ridge = NOISE**2 / SolveOptions().spread ** 2
        self.plain = offsets @ offsets.T
        self.normal = self.plain + ridge * np.eye(len(offsets))
        self.right = observed @ offsets.T
        self.times = np.arange(len(observed)) / rate


def ict(frames: int) -> Case:
    """Return real curves on the ICT face, end to end as often as it takes."""
    mesh, points = ict_mesh(SHARED), landmarks(SHARED)
    recorded, _ = read_take(SHARED / "livelinkface" / "alex_rom_3.csv")
    truth = rename_weights(recorded, mesh.shape_names)[0].weights
    offsets = mesh.offsets_at(points).reshape(len(mesh.shapes), -1)
    there_and_back = np.concatenate([truth, truth[::-1]])
    truth = np.resize(there_and_back, (frames, truth.shape[1]))
    jitter = NOISE * np.random.default_rng(0).standard_normal((frames, offsets.shape[1]))
    return Case("ICT face, real curves", offsets, truth @ offsets + jitter, recorded.rate)


def random(shapes: int, frames: int) -> Case:
    """Return random shapes of 10 mm on as many markers as it takes, frames without relation."""
    rng = np.random.default_rng(1)
    offsets = 0.01 * rng.standard_normal((shapes, max(204, 2 * shapes)))
    truth = rng.uniform(-0.5, 1.5, (frames, shapes))
    return Case(f"random, {shapes} shapes", offsets, truth @ offsets, 60.0)


def in_turns(runs: dict[str, tuple[Run, int]], turns: int) -> dict[str, FloatArray]:
    """Return frames a second, and a second of all cores' time, of each run: (turns, 2)."""
    for run, _ in runs.values():
        run()  # what is loaded or compiled once does not count
    taken = {name: np.empty((turns, 2)) for name in runs}
    for turn in range(turns):
        for name, (run, frames) in runs.items():
            wall, cpu = time.perf_counter(), time.process_time()
            run()
            taken[name][turn] = (
                frames / (time.perf_counter() - wall),
                frames / (time.process_time() - cpu),
            )
    return taken


def daqp_runs(case: Case, frames: int) -> dict[str, tuple[Run, int]]:
    import daqp
    import qpsolvers

    zeros, ones = np.zeros(len(case.normal)), np.ones(len(case.normal))
    some = case.right[:: max(1, len(case.right) // frames)][:frames]

    def through_qpsolvers() -> None:
        for row in some:
            qpsolvers.solve_qp(case.normal, -row, lb=zeros, ub=ones, solver="daqp")

    rows, sense = np.zeros((0, len(ones))), np.zeros(len(ones), np.int32)

    def alone() -> None:
        for row in some:
            daqp.solve(case.normal, -row, rows, ones, zeros, sense)

    few = some[:20]
    root = np.linalg.cholesky(case.normal).T

    def scipy() -> None:
        for row in few:
            lsq_linear(root, np.linalg.solve(root.T, row), (0, 1), method="bvls")

    return {
        "daqp (qpsolvers)": (through_qpsolvers, len(some)),
        "daqp": (alone, len(some)),
        "scipy lsq_linear": (scipy, len(few)),
    }


def without_numba(run: Run) -> Run:
    def plain() -> None:
        with (
            patch("usdface.retarget.solver.bounded_least_squares.kernels", lambda *_: None),
            patch("usdface.retarget.solver.temporal_solve.kernels", lambda *_: None),
        ):
            run()

    return plain


def compare(console: Console, turns: int, daqp_frames: int) -> None:
    table = Table(title=f"frames a second, median of {turns} turns")
    columns = ("case", "solver", "frames / s", "by daqp*", "frames / CPU s", "by daqp*")
    for i, column in enumerate(columns):
        table.add_column(column, justify="right" if i > 1 else "left")
    sizes = ((ict(4030), 1), (random(55, 4000), 1), (random(220, 400), 4))
    for case, fewer in sizes:
        count = len(case.right)

        def exact(case: Case = case) -> object:
            return solve_bounded(case.normal, case.right)

        def take(case: Case = case) -> object:
            return solve_weights(case.plain, case.right, case.times, USUAL)

        runs = daqp_runs(case, daqp_frames // fewer) | {
            "exact, each frame": (exact, count),
            "exact, without numba": (without_numba(exact), count),
        }
        if case is sizes[0][0]:
            runs |= {
                "whole take": (take, count),
                "whole take, without numba": (without_numba(take), count),
            }
        speeds = in_turns(runs, turns)
        for name, speed in speeds.items():
            wall, cpu = np.median(speed, axis=0)
            ratio = np.median(speed / speeds["daqp (qpsolvers)"], axis=0)
            figures = f"{wall:,.0f}", f"{ratio[0]:.2f}", f"{cpu:,.0f}", f"{ratio[1]:.2f}"
            table.add_row(case.name, name, *figures)
        table.add_section()
    console.print(table)
    console.print(
        "* through qpsolvers, in the same turn; all cores' time where others use them too"
    )


def growth(console: Console, sizes: list[int]) -> None:
    table = Table(title="whole take, ICT face: growth with the take (process so far)")
    for column in ("frames", "seconds", "us a frame", "peak MB", "MB of input and result"):
        table.add_column(column, justify="right")
    for frames in sizes:
        case = ict(frames)
        right, times, plain = case.right, case.times, case.plain
        held = 3 * right.nbytes / 1e6
        del case
        begin = time.perf_counter()
        solve_weights(plain, right, times, USUAL)
        seconds = time.perf_counter() - begin
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
        cost = f"{1e6 * seconds / frames:.1f}"
        table.add_row(f"{frames:,}", f"{seconds:.2f}", cost, f"{peak:.0f}", f"{held:.0f}")
    console.print(table)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--turns", type=int, default=9)
    parser.add_argument("--daqp-frames", type=int, default=400)
    parser.add_argument("--sizes", type=int, nargs="*", default=[4_000, 16_000, 64_000])
    options = parser.parse_args()
    console = Console()
    compare(console, options.turns, options.daqp_frames)
    growth(console, options.sizes)


if __name__ == "__main__":
    main()
