"""Recovery of known weights through files: `python -m benchmarks.known_answer`.

Real range-of-motion weights (Live Link Face, 4,030 frames) drive the ICT face; its 68
landmarks, with noise, are the take, after neutral frames with the same noise or with the neutral
given. A TRC file, a take, a shot and `usdface.process` later the weights are read from the solve
layer. Beside ours: an exact box-constrained solve of every frame alone, which is given the head
pose and the neutral. See README.md.
"""

import argparse
import json
import tempfile
import time
from itertools import product
from pathlib import Path

import numpy as np
from pxr import Usd, UsdSkel
from rich.console import Console
from rich.table import Table
from scipy.spatial.transform import Rotation

import usdface
from benchmarks.performers.solvers import write_character, write_trc
from benchmarks.solve.faces import ROOT, Face, ict
from usdface.arrays import FloatArray
from usdface.retarget.solver.bounded_least_squares import solve_bounded

NEUTRAL_FRAMES = (30, 5, 1)
# What 30 further neutral frames show of ten blend shapes, drawn once.
SHOWN = 0.05
ONLY_SOLVED = usdface.ProcessOptions(express=False, closure=False)
DATA = ROOT.parent / "shared" / "data"


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


def solved_weights(
    positions: FloatArray,
    face: Face,
    character: Path,
    neutral_frames: int,
    *,
    moving_head: bool,
) -> tuple[FloatArray, float]:
    """Write a take (F, M, 3) [m] and a shot, process it, and read the solve layer.

    Return the weights (F, S) and the noise that was found [m].
    """
    folder = character.parent
    write_trc(folder / "take.trc", face.names, positions, face.rate)
    usdface.make_take(folder / "take.trc", folder / "take.usdc")
    bind = {
        "markers": {
            name: {"point": point}
            for name, point in zip(face.names, face.points.tolist(), strict=True)
        },
        "head": "solve" if moving_head else "stabilised",
        "neutral": {"start": 0, "end": neutral_frames - 1} if neutral_frames else "rig",
    }
    (folder / "bind.json").write_text(json.dumps(bind), encoding="utf-8")
    shot = folder / "shot.usda"
    usdface.make_shot(character, folder / "take.usdc", shot, bind=folder / "bind.json")
    result = usdface.process(shot, options=ONLY_SOLVED)
    assert result.value.solution is not None
    weights = read_weights(folder / "shot.usdface.usda", face.mesh.shape_names)
    return weights, result.value.solution.noise


def read_weights(path: Path, names: tuple[str, ...]) -> FloatArray:
    """Read the blend shape weights (F, S) that a stage plays."""
    stage = Usd.Stage.Open(str(path))
    animation = next(p for p in stage.Traverse() if p.IsA(UsdSkel.Animation))
    animation = UsdSkel.Animation(animation)
    columns = [list(animation.GetBlendShapesAttr().Get()).index(name) for name in names]
    values = animation.GetBlendShapeWeightsAttr()
    return np.array([values.Get(t) for t in values.GetTimeSamples()], dtype=np.float64)[:, columns]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=4030)
    frames = parser.parse_args().frames
    face = ict(DATA)
    with tempfile.TemporaryDirectory() as folder:
        character = write_character(face, Path(folder))
        Console().print(measured(face, face.curves[:frames], character))


def still_markers(face: Face, truth: FloatArray) -> FloatArray:
    """Return the markers of weights (F, S) without noise, the head at rest: (F, M, 3) [m]."""
    flat = face.offsets.reshape(len(face.offsets), -1)
    return np.asarray(face.neutral + (truth @ flat).reshape(len(truth), *face.neutral.shape))


def exact_error(face: Face, truth: FloatArray, jitter: FloatArray) -> float:
    """Return the error of exact weights of each frame, head pose and neutral given."""
    flat = face.offsets.reshape(len(face.offsets), -1)
    seen = (still_markers(face, truth) + jitter - face.neutral).reshape(len(truth), -1)
    return rms(solve_bounded(flat @ flat.T, seen @ flat.T) - truth)


def performance(
    face: Face,
    truth: FloatArray,
    jitter: FloatArray,
    noise: float,
    count: int,
    *,
    moves: bool,
    shown: float = 0.0,
) -> FloatArray:
    """Return markers (count + F, M, 3) [m], the first `count` of them noisy neutral frames.

    These show `shown` of ten blend shapes.
    """
    rest = np.zeros((count, truth.shape[1]))
    rest[:, np.random.default_rng(2).choice(truth.shape[1], 10, replace=False)] = shown
    whole = still_markers(face, np.concatenate([rest, truth]))
    jolts = noise * np.random.default_rng(1).standard_normal((count, *face.neutral.shape))
    positions = moved(np.arange(len(whole)) / face.rate, whole) if moves else whole
    return np.asarray(positions + np.concatenate([jolts, jitter]))


def figures_of_takes(face: Face, truth: FloatArray, character: Path) -> dict[str, float]:
    """Return errors at 0.3 mm, of those of exact weights, for `benchmarks/take_figures.py`."""
    jitter = 3e-4 * np.random.default_rng(0).standard_normal((len(truth), *face.neutral.shape))
    exact, found = exact_error(face, truth, jitter), {}
    for count, moves in ((0, True), (30, False), (30, True), (5, True)):
        positions = performance(face, truth, jitter, 3e-4, count, moves=moves)
        weights, _ = solved_weights(positions, face, character, count, moving_head=moves)
        name = f"{count or 'given'}, head {'found' if moves else 'known'}"
        found[name] = rms(weights[count:] - truth) / exact
    return found


def measured(face: Face, truth: FloatArray, character: Path) -> Table:
    """Return a table of all noises, heads and neutrals."""
    table = Table(
        title=f"{len(truth)} frames, {len(face.points)} markers, {len(face.offsets)} shapes"
    )
    columns = "noise mm,neutral frames,head,exact per frame,ours,share,noise found"
    for column in (*columns.split(","), "roughness / true", "seconds"):
        table.add_column(column, justify="right")
    rng = np.random.default_rng(0)
    for noise in (0.0, 1e-4, 3e-4, 1e-3):
        jitter = noise * rng.standard_normal((len(truth), *face.neutral.shape))
        exact = exact_error(face, truth, jitter)
        neutrals = [(0, 0.0), *((n, 0.0) for n in NEUTRAL_FRAMES), (NEUTRAL_FRAMES[0], SHOWN)]
        for moves, (count, shown) in product((False, True), neutrals if noise else neutrals[:1]):
            positions = performance(face, truth, jitter, noise, count, moves=moves, shown=shown)
            begin = time.perf_counter()
            weights, found = solved_weights(positions, face, character, count, moving_head=moves)
            seconds = time.perf_counter() - begin
            ours = weights[count:]
            table.add_row(
                f"{1000 * noise:g}",
                (f"{count}, not at rest" if shown else str(count)) if count else "given",
                "found" if moves else "known",
                f"{exact:.4f}" if noise else f"{exact:.0e}",
                f"{rms(ours - truth):.4f}" if noise else f"{rms(ours - truth):.0e}",
                f"{rms(ours - truth) / exact:.3f}" if noise else "",
                f"{1000 * found:.3f}",
                f"{roughness(ours) / roughness(truth):.2f}",
                f"{seconds:.2f}",
            )
    return table


if __name__ == "__main__":
    main()
