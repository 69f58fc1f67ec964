"""USD to GLB and back, beside Blender: `python benchmarks/gltf.py`.

The ICT face (26,719 vertices, 53 shapes) with 4,030 frames of real weights. Each conversion is a
process of its own; time and memory are medians of the runs, each with its own start. Blender is
`bpy` in an environment of its own (`.venv-blender`), glTF-Transform comes from npm. Errors are
those of our certificates, for Blender's files too. Last, the JSON of a document of many objects,
beside pygltflib's own reading. See README.md.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

import numpy as np
from pygltflib import GLTF2
from rich.console import Console
from rich.table import Table

from usdface.clips import Clip
from usdface.face.curve_mapping import rename_weights
from usdface.io.compare_conversion import certify_conversion
from usdface.io.gltf.decode import decode_document
from usdface.io.takes.files import read_take
from usdface.io.usd.rig_write import write_rig
from usdface.io.usd.stage import open_stage
from usdface.rigs import Rig
from usdface.takes import WeightsTake

ROOT = Path(__file__).resolve().parents[1]
SHARED = ROOT.parent / "shared" / "data"
sys.path.insert(0, str(ROOT / "tests"))
from ict_face import ict_mesh  # noqa: E402

RATE = 30
BLENDER = ROOT / ".venv-blender" / "bin" / "python"


def scene(path: Path, frames: int) -> int:
    """Write rig and weights as one stage; return the bytes of its numbers in 32 bits."""
    mesh = ict_mesh(SHARED)
    recorded, _ = read_take(SHARED / "livelinkface" / "alex_rom_3.csv")
    weights, _ = rename_weights(recorded, mesh.shape_names)
    curves = weights.weights[:frames]
    take = WeightsTake(weights.names, np.arange(len(curves)) / RATE, curves, float(RATE))
    write_rig(Rig("ICT", (mesh,)), path, (Clip("take", take),))
    moved = sum(len(shape.indices) for shape in mesh.shapes)
    return 4 * (3 * len(mesh.points) + len(mesh.face_indices) + 7 * moved + curves.size)


def run(command: list[object]) -> tuple[float, float]:
    """Return seconds and peak memory [MB] of a process."""
    begin = time.perf_counter()
    with TemporaryDirectory() as home:
        environment = os.environ | {"BLENDER_USER_RESOURCES": home}
        process = subprocess.Popen(
            [str(word) for word in command],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            env=environment,
        )
        assert process.stderr is not None
        said = process.stderr.read()
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        sys.exit(f"{' '.join(map(str, command))}\n{said.decode()[-2000:]}")
    return time.perf_counter() - begin, usage.ru_maxrss / 1024


def usdface(verb: str, source: Path, result: Path) -> list[object]:
    return [sys.executable, "-m", "usdface", verb, source, "-o", result]


def blender(source: Path, result: Path) -> list[object]:
    return [BLENDER, ROOT / "benchmarks" / "blender_convert.py", source, result, RATE]


def off(stage: Path, file: Path) -> tuple[str, str]:
    """Return the largest vertex error [mm] and weight error, against the glTF's source."""
    certificate, _ = certify_conversion(open_stage(stage), file, exported=True, every_frame=False)
    if certificate is None:
        return "?", "?"
    weight = max(certificate.weights.values(), default=float("nan"))
    return f"{1000 * certificate.vertex_largest:.2g}", f"{weight:.2g}"


def documents(objects: int = 20_000, runs: int = 3) -> Table:
    """Read a document of nodes and channels: processor time, median of the runs."""
    node = {"name": "joint", "translation": [0.0, 1.0, 2.0], "rotation": [0.0, 0.0, 0.0, 1.0]}
    channel = {"sampler": 0, "target": {"node": 0, "path": "rotation"}}
    count = objects // 3
    scene = {"nodes": [node] * count, "animations": [{"channels": [channel] * count}]}
    text = json.dumps({"asset": {"version": "2.0"}, **scene})
    table = Table("reader", "seconds", title=f"JSON with {text.count('{')} objects")
    for name, read in {
        "usdface": lambda: decode_document(json.loads(text)),
        "pygltflib": lambda: GLTF2.from_json(text, infer_missing=True),
    }.items():
        times = []
        for _ in range(runs):
            begin = time.process_time()
            read()
            times.append(time.process_time() - begin)
        table.add_row(name, f"{median(times):.3f}")
    return table


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=4030)
    parser.add_argument("--runs", type=int, default=3, help="of ours; Blender runs once")
    options = parser.parse_args()
    with TemporaryDirectory() as name:
        measure(Path(name), options.frames, options.runs)
    Console().print(documents(runs=options.runs))


def measure(folder: Path, frames: int, runs: int) -> None:
    source = folder / "face.usdc"
    data = scene(source, frames) / 2**20
    table = Table(title=f"ICT face, 53 shapes, {frames} frames; {data:.0f} MB of numbers")
    for head in ("step", "seconds", "peak MB", "peak / data", "file MB", "vertices mm", "weights"):
        table.add_column(head, justify="right" if head != "step" else "left")

    def row(step: str, runs: list[tuple[float, float]], result: Path, errors: tuple[str, str]):
        seconds, memory = (median(column) for column in zip(*runs, strict=True))
        size = result.stat().st_size / 2**20
        table.add_row(
            step, f"{seconds:.2f}", f"{memory:.0f}", f"{memory / data:.1f}", f"{size:.1f}", *errors
        )

    ours, back = folder / "ours.glb", folder / "back.usdc"
    row(
        "usdface, USD to GLB",
        [run(usdface("export", source, ours)) for _ in range(runs)],
        ours,
        off(source, ours),
    )
    row(
        "usdface, GLB to USD",
        [run(usdface("import", ours, back)) for _ in range(runs)],
        back,
        off(back, ours),
    )
    if BLENDER.exists():
        theirs, again = folder / "theirs.glb", folder / "again.usdc"
        row("Blender, USD to GLB", [run(blender(source, theirs))], theirs, off(source, theirs))
        row("Blender, GLB to USD", [run(blender(ours, again))], again, off(again, ours))
    if npx := shutil.which("npx"):
        sparse = folder / "sparse.glb"
        command = [npx, "--yes", "@gltf-transform/cli", "sparse", ours, sparse]
        row("glTF-Transform, sparse", [run(command)], sparse, off(source, sparse))
    Console(width=140).print(table)


if __name__ == "__main__":
    main()
