"""Solvers of a `Performance`: ours through files, and others that are given the head's pose."""

import json
from pathlib import Path

import numpy as np
from scipy.signal import butter, filtfilt

import usdface
from benchmarks.performers.worlds import Performance
from benchmarks.solve.faces import Face
from usdface.arrays import FloatArray
from usdface.geometry.rigid_fit import similarity_fit
from usdface.io.usd.rig_write import write_rig
from usdface.retarget.solver.bounded_least_squares import solve_bounded

__all__ = ["FILTERED", "OURS", "SOLVERS", "make_shot", "processed", "write_character"]

OURS = "ours"
FILTERED = "least squares, similarity, Butterworth 6 Hz"
# Hz, second order, forwards and backwards: what is usual for marker curves.
_CUT_OFF = 6.0


def write_character(face: Face, folder: Path) -> Path:
    """Write the character as a rig file; return its path."""
    path = folder / "character.usdc"
    write_rig(usdface.Rig("character", (face.mesh,)), path)
    return path


def ours(performance: Performance, face: Face, character: Path) -> FloatArray:
    """Solve through files, as `usdface take`, `shot` and `process` do."""
    shot = make_shot(performance, face, character)
    return processed(shot, performance, face)


def with_found_neutral(performance: Performance, face: Face, character: Path) -> FloatArray:
    """Solve the same with a binding that names no neutral frames."""
    shot = make_shot(performance, face, character, named=False)
    return processed(shot, performance, face)


def with_file(performance: Performance, face: Face, character: Path) -> FloatArray:
    """Solve with a performer's file from their other take, as `usdface calibrate` writes it."""
    assert performance.other is not None
    return _calibrated(performance, performance.other, face, character)


def with_range_of_motion(performance: Performance, face: Face, character: Path) -> FloatArray:
    """Solve with a performer's file from their range of motion: `usdface calibrate --extremes`."""
    assert performance.range_of_motion is not None
    return _calibrated(performance, performance.range_of_motion, face, character, extremes=True)


def _calibrated(
    performance: Performance,
    other: Performance,
    face: Face,
    character: Path,
    *,
    extremes: bool = False,
) -> FloatArray:
    file = character.parent / "performer.json"
    usdface.calibrate(make_shot(other, face, character), file, extremes=extremes)
    return processed(make_shot(performance, face, character, file), performance, face)


def make_shot(
    performance: Performance,
    face: Face,
    character: Path,
    calibration: Path | None = None,
    *,
    named: bool = True,
    solve: dict[str, str] | None = None,
) -> Path:
    """Write a performance as a shot, its neutral frames `named` or not; return its path.

    `solve` are settings of the solve, by name.
    """
    folder = character.parent
    take, bind = folder / "take.trc", folder / "bind.json"
    write_trc(take, face.names, performance.positions, face.rate)
    markers = dict(zip(face.names, performance.bound.tolist(), strict=True))
    content: dict[str, object] = {
        "markers": {name: {"point": point} for name, point in markers.items()},
        "head": "solve",
        "solve": solve or {},
    }
    if named:
        content["neutral"] = {"start": 0, "end": performance.neutral_frames - 1}
    bind.write_text(json.dumps(content), encoding="utf-8")
    usdface.make_take(take, folder / "take.usdc")
    shot = folder / "shot.usda"
    usdface.make_shot(character, folder / "take.usdc", shot, bind=bind, calibration=calibration)
    return shot


def processed(shot: Path, performance: Performance, face: Face) -> FloatArray:
    """Return the solved weights of the performance (F, S)."""
    result = usdface.process(shot, options=usdface.ProcessOptions(express=False))
    solved = result.value.solved.reordered(face.mesh.shape_names).weights
    return solved[performance.neutral_frames :]


def write_trc(path: Path, names: tuple[str, ...], positions: FloatArray, rate: float) -> None:
    """Write markers [m] as a TRC file in mm, with the five decimals that its writers use."""
    count, markers = positions.shape[:2]
    head = [
        f"PathFileType\t4\t(X/Y/Z)\t{path.name}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\t"
        "OrigNumFrames",
        f"{rate:g}\t{rate:g}\t{count}\t{markers}\tmm\t{rate:g}\t1\t{count}",
        "Frame#\tTime\t" + "\t".join(f"{name}\t\t" for name in names),
        "\t\t" + "\t".join(f"X{k}\tY{k}\tZ{k}" for k in range(1, markers + 1)),
        "",
    ]
    table = np.column_stack(
        [np.arange(1, count + 1), np.arange(count) / rate, 1000 * positions.reshape(count, -1)]
    )
    with path.open("w", encoding="utf-8") as file:
        file.write("\n".join(head) + "\n")
        for row in np.char.mod("%.5f", table):  # an occluded marker is left empty
            file.write("\t".join(row).replace("nan", "") + "\n")


def filtered(performance: Performance, face: Face, linear: FloatArray) -> FloatArray:
    """Solve each frame by bounded least squares, displacements carried by `linear` (M, 3, 3)."""
    neutral = performance.still[: performance.neutral_frames].mean(axis=0)
    moved = performance.still[performance.neutral_frames :] - neutral
    flat = face.mesh.offsets_at(performance.bound).reshape(len(face.mesh.shapes), -1)
    right = np.einsum("fmi,mij->fmj", moved, linear).reshape(len(moved), -1) @ flat.T
    normal = flat @ flat.T
    weights = solve_bounded(normal + 1e-12 * normal.trace() * np.eye(len(normal)), right)
    b, a = butter(2, _CUT_OFF / (0.5 * face.rate))
    return np.clip(filtfilt(b, a, weights, axis=0), 0, 1)


def least_squares(performance: Performance, face: Face, character: Path) -> FloatArray:
    """Carry displacements by the best similarity."""
    neutral = performance.still[: performance.neutral_frames].mean(axis=0)
    linear, _ = similarity_fit(neutral, face.mesh.points[performance.bound])
    return filtered(performance, face, np.repeat(linear[None], len(neutral), axis=0))


def best_linear(performance: Performance, face: Face, character: Path) -> FloatArray:
    """Carry displacements by the best linear map of each marker, given the performer's shapes."""
    offsets = face.mesh.offsets_at(performance.bound)
    pairs = zip(performance.offsets.swapaxes(0, 1), offsets.swapaxes(0, 1), strict=True)
    maps = [np.linalg.lstsq(own, theirs, rcond=None)[0] for own, theirs in pairs]
    return filtered(performance, face, np.stack(maps))


SOLVERS = {
    OURS: ours,
    "the same, neutral found": with_found_neutral,
    "the same, performer's file": with_file,
    "the same, from a range of motion": with_range_of_motion,
    FILTERED: least_squares,
    "the same, best linear maps (given)": best_linear,
}
