"""A made take of any length: recorded curves on the ICT face, 68 landmarks, 53 blend shapes."""

import json
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from usdface.arrays import FloatArray
from usdface.face.curve_mapping import rename_weights
from usdface.io.takes.files import read_take
from usdface.io.usd.rig_write import write_rig
from usdface.io.usd.take_write import write_take
from usdface.options import ProcessOptions
from usdface.pipeline.kept_pieces import KeptPieces
from usdface.pipeline.schemas import register_schemas
from usdface.rigs import Mesh, Rig
from usdface.shot.piece_cuts import PieceCuts
from usdface.shot.retarget_pieces import solve_cut
from usdface.takes import MarkerTake

__all__ = ["make_long_shot", "run_long"]

ROOT = Path(__file__).resolve().parents[2]
SHARED = ROOT.parent / "shared" / "data"
sys.path.insert(0, str(ROOT / "tests"))
from ict_face import ict_mesh, landmarks  # noqa: E402

_NEUTRAL, _FADE = 24, 12  # frames of rest, and of the passage to the motion
_NOISE = 2e-4  # m
_OCCLUDED = 0.01  # share of all places
_GAP = 12  # frames of an occlusion
_RATE = 30.0
_COMPARED = 4  # pieces that are also solved as one
_MEASURED = """
import re, resource, sys, threading
from pathlib import Path
peak, over = 0, threading.Event()
def watch():
    global peak
    while not over.wait(0.1):
        found = re.search(r"RssAnon:\\s*(\\d+)", Path("/proc/self/status").read_text())
        peak = max(peak, int(found[1]))
watching = threading.Thread(target=watch)
watching.start()
from usdface.cli import main
status = main(sys.argv[1:])
over.set()
watching.join()
own, other = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
worked = own.ru_utime + own.ru_stime + other.ru_utime + other.ru_stime
print(worked, peak, own.ru_maxrss, other.ru_maxrss, file=sys.stderr)
sys.exit(status)
"""
_CHUNK = 20_000  # frames that are made at once


def make_long_shot(folder: Path, frames: int, seed: int = 0) -> tuple[Path, Path, Path]:
    """Write rig, take and binding of so many frames; return the three files."""
    folder.mkdir(parents=True, exist_ok=True)
    mesh, points = ict_mesh(SHARED), landmarks(SHARED)
    names = tuple(f"landmark_{i:02}" for i in range(len(points)))
    rig, take, bind = (folder / name for name in ("rig.usdc", "take.usdc", "bind.json"))
    write_rig(Rig("ict", (mesh,)), rig)
    bind.write_text(
        json.dumps(
            {
                "markers": {n: {"point": p} for n, p in zip(names, points.tolist(), strict=True)},
                "neutral": {"start": 0, "end": _NEUTRAL - 1},
                "nose_tip": "landmark_30",
            }
        )
    )
    positions = np.empty((frames, len(points), 3))
    chance = np.random.default_rng(seed)
    curves = _curves(mesh, frames)
    for first in range(0, frames, _CHUNK):
        part = slice(first, min(first + _CHUNK, frames))
        positions[part] = _markers(mesh, points, curves[part], np.arange(part.start, part.stop))
        positions[part] += _NOISE * chance.standard_normal(positions[part].shape)
    _occlude(positions, chance)
    write_take(MarkerTake(names, np.arange(frames) / _RATE, positions, rate=_RATE), take)
    return rig, take, bind


def _curves(mesh: Mesh, frames: int) -> FloatArray:
    """Return recorded weights (F, S), there and back as often as it takes, after some rest."""
    recorded, _ = read_take(SHARED / "livelinkface" / "alex_rom_3.csv")
    truth = rename_weights(recorded, mesh.shape_names)[0].weights
    order = np.concatenate([np.arange(len(truth)), np.arange(len(truth))[::-1]])
    curves = np.clip(truth, 0.0, 1.0)[np.resize(order, frames)].astype(np.float32)
    rise = np.clip((np.arange(min(frames, _NEUTRAL + _FADE)) - _NEUTRAL) / _FADE, 0.0, 1.0)
    curves[: len(rise)] *= rise[:, None].astype(np.float32)
    return np.asarray(curves)


def _markers(mesh: Mesh, points: FloatArray, curves: FloatArray, frames: FloatArray) -> FloatArray:
    """Return the markers (F, M, 3) of a head that turns slowly."""
    offsets = mesh.offsets_at(points).reshape(len(mesh.shapes), -1)
    still = mesh.points[points] + (curves @ offsets).reshape(len(curves), -1, 3)
    start = np.clip((frames - _NEUTRAL) / 60.0, 0.0, 1.0)
    time = frames / _RATE
    angles = np.stack([0.2 * np.sin(0.7 * time), 0.3 * np.sin(0.43 * time), 0.1 * np.sin(time)], 1)
    turned = Rotation.from_rotvec(start[:, None] * angles).as_matrix()
    return np.asarray(np.einsum("fmi,fij->fmj", still, turned))


def _occlude(positions: FloatArray, chance: np.random.Generator) -> None:
    """Hide single markers for some frames, after the rest."""
    frames, markers = positions.shape[:2]
    count = int(_OCCLUDED * frames * markers / _GAP)
    first = chance.integers(_NEUTRAL, max(frames - _GAP, _NEUTRAL + 1), count)
    marker = chance.integers(0, markers, count)
    for step in range(_GAP):
        positions[np.minimum(first + step, frames - 1), marker] = np.nan


def run_long(folder: Path, frames: int, workers: int) -> None:
    """Make, estimate, solve and join a take of so many frames by the command line; print the cost.

    Then the first pieces are solved as one, with the same estimates, and compared with the joined
    result on all their frames.
    """
    rig, take, bind = make_long_shot(folder, frames)
    shot, pieces = folder / "shot.usda", folder / "pieces"
    files = ["--rig", str(rig), "--take", str(take), "--bind", str(bind)]
    print(f"{frames} frames, {take.stat().st_size / 1e6:.0f} MB as USD")
    _step("shot", ["shot", *files, "-o", str(shot)])
    common = ["process", str(shot), "--pieces", str(pieces)]
    cuts = PieceCuts.of(frames)
    _step("estimates", [*common, "--piece", "estimates"])
    if workers > 1:
        _step("a piece alone", [*common, "--piece", "0", "--workers", "1"])
    _step(
        f"{len(cuts)} pieces, {workers} workers",
        [*common, "--piece", f"0-{len(cuts) - 1}", "--workers", str(workers)],
    )
    _step("join, express, close, write", [*common, "--workers", str(workers)])
    compared = min(_COMPARED, len(cuts))
    away = difference(shot, pieces, compared)
    print(f"weights of the first {compared} pieces, solved as one: {away:.1e} apart at most")


def difference(shot: Path, folder: Path, count: int) -> float:
    """Return by how much the first pieces of a folder differ from these frames solved at once."""
    register_schemas()
    pieces = KeptPieces(shot, folder, ProcessOptions(), None)
    known, cuts = pieces.estimates(), pieces.cuts
    end = cuts.pieces[count]
    whole = solve_cut(pieces.read, cuts, 0, end, known)
    away = 0.0
    for number in range(count):
        first, last = cuts.piece(number)
        part = pieces.piece(number, known)
        apart = part.solution.weights.weights - whole.solution.weights.weights[first:last]
        away = max(away, float(np.abs(apart).max()))
    return away


def _step(name: str, words: list[str]) -> None:
    """Run a command; print wall time, processor time and memory.

    Of the command itself without files that it maps, and with them, since the system may take
    these back; of its largest worker.
    """
    begin = time.perf_counter()
    command = [sys.executable, "-c", _MEASURED, *words]
    run = subprocess.run(command, capture_output=True, text=True, check=True)
    wall = time.perf_counter() - begin
    worked, own, mapped, workers = map(float, run.stderr.splitlines()[-1].split())
    memory = f"{own / 1e3:.0f} MB, {mapped / 1e3:.0f} with mapped files"
    memory += f", a worker {workers / 1e3:.0f} MB" if workers else ""
    print(f"{name:32}{wall:9.1f} s {worked:9.1f} s of processor time, {memory}", flush=True)
