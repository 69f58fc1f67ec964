"""The certificate of a conversion between USD and glTF."""

from pathlib import Path

import numpy as np

from usdface.certificate import Certificate, EvaluatedMesh, certify, some_frames
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.gltf.evaluate import evaluate_gltf
from usdface.io.gltf.shown import ShownMesh
from usdface.io.usd.errors import one_line, usd_errors
from usdface.io.usd.evaluate import StagedMesh, evaluate_usd, keys_of_stage
from usdface.io.usd.stage import Stage, metrics_of
from usdface.takes import FloatArray

__all__ = ["certified"]

_QUICK = 500_000  # vertices over all frames: a fraction of a second
_UNKNOWN = (ArithmeticError, InputError, LookupError, MemoryError, TypeError, ValueError)
_NEAR = 1e-6  # of a time, and of a second


def certified(
    stage: Stage, gltf: Path, *, exported: bool, every_frame: bool
) -> tuple[Certificate | None, list[Finding]]:
    """Compare what USD shows of a stage with what glTF shows of a file.

    The moments are all keys of the file, and those of the stage that it lacks; where a curve
    is cubic, also the middle between two keys.

    Parameters
    ----------
    stage : Stage
    gltf : Path
    exported : bool
        The stage is the source; else the file is.
    every_frame : bool
        Compare vertices at all moments, else at as many as take a fraction of a second.

    Returns
    -------
    Certificate or None
        None where the file has what the evaluator does not know.
    list of Finding
    """
    try:
        with usd_errors(stage.GetRootLayer().realPath):
            certificate = _certificate(stage, gltf, exported, every_frame)
    except _UNKNOWN as error:
        message = f"not compared with its source: {one_line(str(error))}"
        return None, [finding("CONVERSION_UNCERTIFIED", gltf.name, message)]
    where = gltf.name if exported else Path(stage.GetRootLayer().realPath).name
    return certificate, certificate.findings(where)


def _certificate(stage: Stage, gltf: Path, exported: bool, every_frame: bool) -> Certificate:
    shown, staged = evaluate_gltf(gltf), evaluate_usd(stage)
    codes, stage_times = keys_of_stage(stage)
    gltf_times = np.unique(np.concatenate([np.zeros(0), *(mesh.times for mesh in shown)]))
    # Keys that only one side has, for a curve or an inbetween, change no time.
    drift = min(_drift(stage_times, gltf_times), _drift(gltf_times, stage_times))
    cubic = any(mesh.interpolation == "CUBICSPLINE" for mesh in shown)
    between = (gltf_times[1:] + gltf_times[:-1]) / 2 if cubic else np.zeros(0)
    known = np.concatenate([gltf_times, between])
    lacking = stage_times[np.abs(_nearest(known, stage_times) - stage_times) > _near(stage_times)]
    times = np.unique(np.concatenate([known, lacking]))
    there = _nearest(stage_times, times)
    exact = np.abs(there - times) <= _near(times)
    start = codes[0] - stage_times[0] * metrics_of(stage).time_codes_per_second
    moments = np.where(
        exact,
        codes[np.searchsorted(stage_times, there)],
        start + times * metrics_of(stage).time_codes_per_second,
    )
    usd = [_of_stage(mesh, moments) for mesh in staged]
    file = [_of_file(mesh, times) for mesh in shown]
    vertices = sum(len(mesh.points) for mesh in shown)
    budget = vertices * len(times) if every_frame else _QUICK
    frames = some_frames(len(times), vertices, budget)
    return certify(*((usd, file) if exported else (file, usd)), frames, drift, float(times[-1]))


def _drift(one: FloatArray, other: FloatArray) -> float:
    return float(np.abs(one - _nearest(other, one)).max(initial=0.0))


def _near(times: FloatArray) -> FloatArray:
    return np.asarray(_NEAR * (1.0 + np.abs(times)))


def _nearest(keys: FloatArray, times: FloatArray) -> FloatArray:
    """Return for each of `times` the nearest of `keys`, which increase."""
    if not len(keys):
        return np.zeros(len(times))
    right = np.searchsorted(keys, times).clip(max=len(keys) - 1)
    left = (right - 1).clip(min=0)
    nearer = np.abs(keys[left] - times) < np.abs(keys[right] - times)
    return np.asarray(np.where(nearer, keys[left], keys[right]), np.float64)


def _of_stage(mesh: StagedMesh, codes: FloatArray) -> EvaluatedMesh:
    return EvaluatedMesh(
        mesh.name,
        mesh.shapes,
        mesh.weights_at(codes),
        lambda frames: mesh.points_at(codes[frames]),
        lambda frames: mesh.normals_at(codes[frames]),
    )


def _of_file(mesh: ShownMesh, times: FloatArray) -> EvaluatedMesh:
    return EvaluatedMesh(
        mesh.name,
        *mesh.channels_at(times),
        lambda frames: mesh.points_at(times[frames]),
        lambda frames: mesh.normals_at(times[frames]),
    )
