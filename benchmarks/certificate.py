"""Processor time of an export with and without its whole certificate.

`python benchmarks/certificate.py`: the processed example, whose head moves (once more with
`--no-head`), and a sheet of 100,000 vertices with 200 sparse shapes, on a head that stands
still and on one that moves, and once with discs of a tenth of the radius. Each export is a
process of its own. See README.md.
"""

import argparse
import os
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.spatial.transform import Rotation

from usdface.blend_shapes.blend_shape import BlendShape
from usdface.clips import Clip, JointsTake
from usdface.io.usd.rig_write import write_rig
from usdface.rigs import Mesh, Rig, Skeleton, Skin
from usdface.takes import WeightsTake

ROOT = Path(__file__).resolve().parents[1]
SIDE, SHAPES, RATE = 316, 200, 30.0


def sheet(path: Path, frames: int, moving: bool, radius: float = 0.02) -> None:
    """Write a curved sheet, each of whose shapes moves a disc, on one joint."""
    rng = np.random.default_rng(0)
    axis = np.linspace(-0.1, 0.1, SIDE)
    flat = np.stack(np.meshgrid(axis, axis), -1).reshape(-1, 2)
    points = np.concatenate([flat, 0.05 * np.cos(20 * flat[:, :1])], 1)
    index = np.arange(SIDE * SIDE).reshape(SIDE, SIDE)
    quads = np.stack([index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]], -1)
    shapes = []
    for number, centre in enumerate(rng.choice(flat, SHAPES)):
        away = np.linalg.norm(flat - centre, axis=1)
        inside = np.flatnonzero(away < radius)
        offsets = np.zeros((len(inside), 3))
        offsets[:, 2] = 0.005 * (1 - (away[inside] / radius) ** 2)
        shapes.append(BlendShape(f"shape{number}", inside, offsets))
    held = Skin(np.zeros((len(points), 1), np.int64), np.ones((len(points), 1)))
    faces = np.full(quads.size // 4, 4)
    mesh = Mesh("sheet", points, faces, quads.ravel(), shapes=tuple(shapes), skin=held)
    times = np.arange(frames) / RATE
    phases = 3 * times[:, None] + np.arange(SHAPES)
    names = tuple(shape.name for shape in shapes)
    weights = WeightsTake(names, times, 0.5 + 0.5 * np.sin(phases), RATE)
    joints = None
    if moving:
        turns = Rotation.from_rotvec(np.sin(times)[:, None] * [0.1, 0.3, 0.0]).as_quat()[:, None]
        moves, size = 0.02 * np.sin(phases[:, None, :3]), np.ones((frames, 1, 3))
        joints = JointsTake(("head",), times, moves, turns, size, RATE)
    skeleton = Skeleton(("head",), ("head",), np.eye(4)[None], np.eye(4)[None])
    write_rig(Rig("sheet", (mesh,), skeleton), path, (Clip("take", weights, joints),))


def cpu_seconds(*words: object) -> float:
    """Return the processor time of a command of usdface."""
    process = subprocess.Popen(
        [sys.executable, "-m", "usdface", *map(str, words)],
        stdout=subprocess.DEVNULL,
        env=os.environ | {"USDFACE_TRUSTED": "1"},
    )
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        sys.exit(f"usdface {' '.join(map(str, words))} failed")
    return usage.ru_utime + usage.ru_stime


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=720, help="of the sheet")
    frames = parser.parse_args().frames
    with TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copytree(ROOT / "examples", folder / "examples")
        shot = folder / "examples" / "shot.usda"
        cases = {}
        for case, more in (("moves", ()), ("still", ("--no-head",))):
            cases[f"example, head {case}"] = folder / "examples" / f"{case}.usda"
            cpu_seconds("process", shot, "-o", cases[f"example, head {case}"], *more)
        for case in ("still", "moves"):
            cases[f"sheet, head {case}"] = folder / f"sheet_{case}.usdc"
            sheet(cases[f"sheet, head {case}"], frames, case == "moves")
        cases["sheet, 6 % moves"] = folder / "sheet_little.usdc"
        sheet(cases["sheet, 6 % moves"], frames, False, 0.002)
        for case, source in cases.items():
            result = folder / "result.glb"
            alone = cpu_seconds("export", source, "-o", result)
            whole = cpu_seconds("export", source, "-o", result, "--report", folder / "report.json")
            print(f"{case:24} {alone:7.2f} s  {whole:7.2f} s  {whole / alone:5.2f}")


if __name__ == "__main__":
    main()
