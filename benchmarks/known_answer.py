"""Recovery of known weights: `python benchmarks/known_answer.py`.

Real range-of-motion weights (Live Link Face, 4,030 frames) drive the ICT face; its 68
landmarks, with noise, are the take, after neutral frames with the same noise or with the neutral
given. It is retargeted as `usdface process` does it, clean-up and places included. Beside ours: an
exact box-constrained solve of every frame alone, which is told the head pose and the neutral. See
README.md.
"""

import argparse
import sys
import time
from itertools import product
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.spatial.transform import Rotation

from usdface.arrays import FloatArray
from usdface.face.shape_names import rename_weights
from usdface.io.takes.files import read_take
from usdface.options import ProcessOptions
from usdface.retarget.bounded_least_squares import solve_bounded
from usdface.retarget_setup import Binding, RetargetSetup
from usdface.retarget_shot import retarget
from usdface.rigs import Rig
from usdface.shot import Shot
from usdface.takes import MarkerTake

NEUTRAL_FRAMES = (30, 5, 1)
ONLY_SOLVED = ProcessOptions(express=False, closure=False)
ROOT = Path(__file__).resolve().parents[1]
SHARED = ROOT.parent / "shared" / "data"
sys.path.insert(0, str(ROOT / "tests"))
from ict_face import ict_mesh, landmarks  # noqa: E402


def moved(times: FloatArray, positions: FloatArray) -> FloatArray:
    """Turn the head by up to 8 degrees and move it by a centimetre."""
    swing = np.stack([6 * np.sin(1.1 * times), 8 * np.sin(0.7 * times), 4 * np.sin(0.9 * times)], 1)
    turn = Rotation.from_euler("xyz", swing, degrees=True).as_matrix()
    shift = 0.01 * np.sin(times[:, None] * [0.8, 0.5, 0.3])
    return np.asarray(positions @ turn.transpose(0, 2, 1) + shift[:, None])


def rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def roughness(weights: FloatArray) -> float:
    return rms(np.diff(weights, 2, axis=0))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=4030)
    frames = parser.parse_args().frames
    mesh, points = ict_mesh(SHARED), landmarks(SHARED)
    recorded, _ = read_take(SHARED / "livelinkface" / "alex_rom_3.csv")
    truth = rename_weights(recorded, mesh.shape_names)[0].weights[:frames]
    neutral, offsets = mesh.points[points], mesh.offsets_at(points)
    flat = offsets.reshape(len(offsets), -1)
    face = neutral + (truth @ flat).reshape(len(truth), *neutral.shape)
    names = tuple(f"landmark_{i}" for i in range(len(points)))

    table = Table(title=f"{len(truth)} frames, {len(points)} markers, {len(flat)} shapes")
    columns = "noise mm,neutral frames,head,exact per frame,ours,share,noise found"
    for column in (*columns.split(","), "roughness / true", "seconds"):
        table.add_column(column, justify="right")
    rng = np.random.default_rng(0)
    for noise in (0.0, 1e-4, 3e-4, 1e-3):
        jitter = noise * rng.standard_normal(face.shape)
        seen = (face + jitter - neutral).reshape(len(truth), -1)
        exact = rms(solve_bounded(flat @ flat.T, seen @ flat.T) - truth)
        for head, count in product(
            ("stabilised", "solve"), (0, *NEUTRAL_FRAMES) if noise else (0,)
        ):
            whole = np.concatenate([np.repeat(neutral[None], count, axis=0), face])
            times = np.arange(len(whole)) / recorded.rate
            still = noise * np.random.default_rng(1).standard_normal((count, *neutral.shape))
            positions = moved(times, whole) if head == "solve" else whole
            positions = positions + np.concatenate([still, jitter])
            frames = (0, count - 1) if count else None
            setup = RetargetSetup(Binding(names, points), head=head, neutral=frames)
            take = MarkerTake(names, times, positions, recorded.rate)
            begin = time.perf_counter()
            shot = Shot(Rig("Face", (mesh,)), take, setup)
            result = retarget(shot, options=ONLY_SOLVED)
            seconds = time.perf_counter() - begin
            assert result.solution is not None
            ours = result.solved.weights[count:]
            table.add_row(
                f"{1000 * noise:g}",
                str(count) if count else "given",
                "known" if head == "stabilised" else "found",
                f"{exact:.4f}" if noise else f"{exact:.0e}",
                f"{rms(ours - truth):.4f}" if noise else f"{rms(ours - truth):.0e}",
                f"{rms(ours - truth) / exact:.2f}" if noise else "",
                f"{1000 * result.solution.noise:.3f}",
                f"{roughness(ours) / roughness(truth):.2f}",
                f"{seconds:.2f}",
            )
    Console().print(table)


if __name__ == "__main__":
    main()
