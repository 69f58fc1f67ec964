"""`usdface process` on a long take, beside USD alone: `python benchmarks/process.py`.

Real weights drive the ICT face; its 68 landmarks, with 0.3 mm of noise on a moving head, are
the take. Every run is a process of its own; figures are medians. See README.md.
"""

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from statistics import median

import numpy as np

from usdface.cli import main as usdface
from usdface.face.curve_mapping import rename_weights
from usdface.io.takes.files import read_take
from usdface.io.usd.rig import read_rig
from usdface.io.usd.take_write import write_take
from usdface.takes import MarkerTake

ROOT = Path(__file__).resolve().parents[1]
SHARED = ROOT.parent / "shared" / "data"
sys.path.insert(0, str(ROOT / "tests"))
from ict_face import landmarks, write_meshes  # noqa: E402

RATE = 30.0
NOISE = 3e-4  # m

IMPORTS = """
import rich.console, rich.table, usdface.cli.report, usdface.pipeline.processing
import usdface.io.usd.layers, usdface.io.usd.shot
"""
# What USD does with the same files: compose the shot, read and write every layer.
FLOOR = """
import sys, time
from pathlib import Path
from pxr import Sdf, Usd, UsdGeom, UsdSkel
begin = time.perf_counter()
root, out = sys.argv[1:]
stage = Usd.Stage.Open(root)
for number, layer in enumerate(stage.GetUsedLayers()):
    if layer.realPath and not layer.realPath.endswith("generatedSchema.usda"):
        layer.Export(str(Path(out) / f"{number}{Path(layer.realPath).suffix}"))
print(time.perf_counter() - begin)
"""


def make_shot(folder: Path, frames: int) -> Path:
    """Make rig (once), take and shot of a take of so many frames."""
    rig = folder / "rig.usdc"
    if not rig.exists():
        write_meshes(SHARED, folder / "face")
        run(["rig", folder / "face", "-o", rig])
    mesh = read_rig(rig)[0].meshes[0]
    points = landmarks(SHARED)
    recorded, _ = read_take(SHARED / "livelinkface" / "alex_rom_3.csv")
    curves = rename_weights(recorded, mesh.shape_names)[0].weights
    # To and fro, so that a longer take has no seam.
    curves = np.resize(np.concatenate([curves, curves[::-1]]), (frames, curves.shape[1]))
    positions = mesh.points[points] + np.einsum("fs,smd->fmd", curves, mesh.offsets_at(points))
    names = tuple(f"landmark{k}" for k in range(len(points)))
    shot = folder / f"shot{frames}.usda"
    take, bind = folder / f"take{frames}.usdc", folder / "bind.json"
    made = moving(positions + NOISE * np.random.default_rng(1).normal(size=positions.shape))
    write_take(MarkerTake(names, np.arange(frames) / RATE, made, RATE, 0.001), take)
    markers = {name: {"point": int(point)} for name, point in zip(names, points, strict=True)}
    bind.write_text(json.dumps({"markers": markers, "neutral": "rig", "nose_tip": "landmark30"}))
    run(["shot", "--rig", rig, "--take", take, "--bind", bind, "-o", shot])
    return shot


def moving(positions: np.ndarray) -> np.ndarray:
    """Shake the head by five degrees and move it by a centimetre."""
    seconds = np.arange(len(positions)) / RATE
    angle = np.radians(5) * np.sin(0.7 * seconds)
    turn = np.tile(np.eye(3), (len(positions), 1, 1))
    turn[:, 0, 0] = turn[:, 2, 2] = np.cos(angle)
    turn[:, 0, 2], turn[:, 2, 0] = np.sin(angle), -np.sin(angle)
    sway = 0.01 * np.sin(np.outer(seconds, [0.4, 0.6, 0.2]))
    return positions @ turn.transpose(0, 2, 1) + sway[:, None]


def run(words: list) -> None:
    """Run a command of usdface in this process, quietly."""
    with redirect_stdout(StringIO()):
        status = usdface(list(map(str, words)))
    if status != 0:
        sys.exit(f"usdface {' '.join(map(str, words))} failed")


def child(*words: str | Path) -> tuple[float, str]:
    """Run Python on `words` in a process of its own; return its seconds and what it printed."""
    begin = time.perf_counter()
    done = subprocess.run([sys.executable, *map(str, words)], check=True, stdout=subprocess.PIPE)
    return time.perf_counter() - begin, done.stdout.decode()


def process(shot: Path, *flags: str | Path) -> tuple[float, dict]:
    """Run `usdface process`; return its seconds and its report."""
    words = ("-m", "usdface", "process", shot, *flags, "--format", "json")
    seconds, printed = child(*words)
    return seconds, json.loads(printed)


def cpu_seconds(shot: Path, *flags: str) -> float:
    """Return the processor time of `usdface process`."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    process(shot, *flags)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def layer(shot: Path, pairs: int) -> None:
    """Print what the expression layer adds, its files included, in pairs of runs."""
    runs = [(cpu_seconds(shot, "--no-express"), cpu_seconds(shot)) for _ in range(pairs)]
    without, whole = map(median, zip(*runs, strict=True))
    more = [100 * (b / a - 1) for a, b in runs]
    print(
        f"expression layer: {without:.2f} s CPU without, {whole:.2f} s with, "
        f"{median(more):+.1f} % ({min(more):+.1f} to {max(more):+.1f} in {pairs} pairs)"
    )


def stages(shot: Path, folder: Path, runs: int) -> None:
    """Print the time of each stage, and the floor."""
    done = [process(shot, "--gltf", folder / "out.glb") for _ in range(runs)]
    steps = list(done[0][1]["seconds"])
    per_step = {s: median([report["seconds"][s] for _, report in done]) for s in steps}
    whole = median([seconds for seconds, _ in done]) - per_step["gltf"]
    imports = median([child("-c", IMPORTS)[0] for _ in range(runs)])
    root = shot.with_name(f"{shot.stem}.usdface.usda")
    floors = []
    for _ in range(runs):
        with tempfile.TemporaryDirectory() as copies:
            floors.append(float(child("-c", FLOOR, root, copies)[1]))
    floor = median(floors)
    rows = {step: seconds for step, seconds in per_step.items() if step != "gltf"}
    rows["Python and imports alone"] = imports
    rows["whole command"] = whole
    rows["USD: open and save the same files"] = floor
    rows["--gltf, when asked for"] = per_step["gltf"]
    for name, seconds in rows.items():
        print(f"{name:<36} {seconds:7.2f} s")
    print(f"{'whole command / (imports + floor)':<36} {whole / (imports + floor):7.2f}")
    print(f"{'(whole command - imports) / floor':<36} {(whole - imports) / floor:7.2f}")
    peak = median([report["peak_memory_mb"] for _, report in done])
    print(f"{'peak memory, with --gltf':<36} {peak:7.0f} MB")


def compiled(shot: Path, runs: int) -> None:
    """Print the processor time as installed, and where numba is absent, in turns."""
    installs = {"as installed": "pass", "without numba": "sys.modules['numba'] = None"}
    call = "import sys; {}; from usdface.cli import main; sys.exit(main(sys.argv[1:]))"
    done: dict[str, list[float]] = {name: [] for name in installs}
    for _ in range(runs):
        for name, code in installs.items():
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            child("-c", call.format(code), "process", shot, "--format", "json")
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            done[name].append(after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime)
    for name, seconds in done.items():
        print(f"{name:<36} {median(seconds):7.2f} s CPU")


def sizes(folder: Path, counts: list[int], runs: int) -> None:
    """Print how time and memory grow with the take."""
    print(f"\n{'frames':>7} {'whole s':>8} {'solve s':>8} {'peak MB':>8}")
    for frames in counts:
        shot = make_shot(folder, frames)
        done = [process(shot) for _ in range(runs)]
        whole = median([seconds for seconds, _ in done])
        solve = median([report["seconds"]["solve"] for _, report in done])
        peak = median([report["peak_memory_mb"] for _, report in done])
        print(f"{frames:>7} {whole:8.2f} {solve:8.2f} {peak:8.0f}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=4000)
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--pairs", type=int, default=9)
    parser.add_argument("--sizes", type=int, nargs="*", default=[1000, 2000, 4000, 8000])
    parsed = parser.parse_args()
    if not SHARED.is_dir():
        sys.exit("the real data (../shared/data) is not beside this clone")
    with tempfile.TemporaryDirectory() as place:
        made = make_shot(Path(place), parsed.frames)
        print(f"{parsed.frames} frames x 68 markers x 53 shapes on 26,719 vertices")
        stages(made, Path(place), parsed.runs)
        compiled(made, parsed.runs)
        layer(made, parsed.pairs)
        sizes(Path(place), parsed.sizes, parsed.runs)
