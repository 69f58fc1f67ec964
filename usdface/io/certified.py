"""The certificate of a conversion between USD and glTF."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from usdface.advice import RAISING
from usdface.certificate.certificate import Certificate
from usdface.certificate.compare import EvaluatedMesh, certify, paired, some_frames
from usdface.certificate.joined import joined
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.gltf.evaluate import ShownClip, evaluate_clips
from usdface.io.gltf.shown import ShownMesh
from usdface.io.usd.errors import one_line, usd_errors
from usdface.io.usd.evaluate import StagedMesh, evaluate_usd, keys_of_stage
from usdface.io.usd.playing import playing
from usdface.io.usd.stage import Stage, metrics_of
from usdface.takes import FloatArray

__all__ = ["certified"]

_QUICK = 500_000  # vertices over all frames: a fraction of a second
_UNKNOWN = (ArithmeticError, InputError, LookupError, MemoryError, TypeError, ValueError)
_NEAR = 1e-6  # of a time, and of a second


def certified(
    stage: Stage, gltf: Path, *, exported: bool, every_frame: bool, clip: str = ""
) -> tuple[Certificate | None, list[Finding]]:
    """Compare what USD shows of a stage with what glTF shows of a file.

    In each clip; clips belong together by name, or by place where there are equally many. The
    moments are all keys of the file, and those of the stage that it lacks; where a curve is cubic,
    also the middle between two keys.

    Parameters
    ----------
    stage : Stage
    gltf : Path
    exported : bool
        The stage is the source; else the file is.
    every_frame : bool
        Compare vertices at all moments, else at as many as take a fraction of a second.
    clip : str
        The one clip that was to be converted; "" = all.

    Returns
    -------
    Certificate or None
        None where the file has what the evaluator does not know.
    list of Finding
    """
    try:
        with usd_errors(stage.GetRootLayer().realPath):
            certificate = _certificate(stage, gltf, exported, every_frame, clip)
    except Exception as error:  # of any kind: what was written does not depend on it
        if RAISING.get() and not isinstance(error, _UNKNOWN):
            raise
        message = f"not compared with its source: {one_line(str(error))}"
        return None, [finding("CONVERSION_UNCERTIFIED", gltf.name, message)]
    where = gltf.name if exported else Path(stage.GetRootLayer().realPath).name
    return certificate, certificate.findings(where)


def _certificate(
    stage: Stage, gltf: Path, exported: bool, every_frame: bool, clip: str
) -> Certificate:
    shown, stages = evaluate_clips(gltf), list(playing(stage))
    names = [keys_of_stage(staged)[0] for staged in stages]
    if len(stages) > 1:  # as one that stands still is none of several clips
        stages = [s for s in stages if len(keys_of_stage(s)[1]) > 1] or stages[:1]
        stages = [s for s in stages if clip in ("", keys_of_stage(s)[0])]
        names = [keys_of_stage(staged)[0] for staged in stages]
    pairs, missing = paired(names, [clip.name for clip in shown], "clip ")
    certificates = {
        names[i]: _of_clip(
            stages[i], shown[j], exported, None if every_frame else _QUICK // len(pairs)
        )
        for i, j in pairs
    }
    decoded = any(clip.decoded for clip in shown)
    return replace(joined(certificates, missing), decoded=decoded)


def _of_clip(stage: Stage, shown: ShownClip, exported: bool, budget: int | None) -> Certificate:
    staged = evaluate_usd(stage)
    _, codes, stage_times = keys_of_stage(stage)
    gltf_times = shown.times if len(shown.times) else np.zeros(1)
    # Keys that only one side has, for a curve or an inbetween, change no time.
    drift = min(_drift(stage_times, gltf_times), _drift(gltf_times, stage_times))
    between = (gltf_times[1:] + gltf_times[:-1]) / 2 if shown.cubic else np.zeros(0)
    known = np.unique(np.concatenate([gltf_times, between]))
    lacking = stage_times[np.abs(_nearest(known, stage_times) - stage_times) > _near(stage_times)]
    times = np.unique(np.concatenate([known, lacking]))
    there = _nearest(stage_times, times)
    exact = np.abs(there - times) <= _near(times)
    rate = metrics_of(stage).time_codes_per_second
    start = codes[0] - stage_times[0] * rate
    at_keys = codes[np.searchsorted(stage_times, there)]
    moments = np.where(exact, at_keys, start + times * rate)
    usd = [_of_stage(mesh, moments) for mesh in staged]
    file = [_of_file(mesh, times) for mesh in shown.meshes]
    vertices = sum(len(mesh.points) for mesh in shown.meshes)
    frames = some_frames(len(times), vertices, vertices * len(times) if budget is None else budget)
    return certify(*((usd, file) if exported else (file, usd)), frames, drift, times)


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
        lambda: mesh.sums_at(codes),
    )


def _of_file(mesh: ShownMesh, times: FloatArray) -> EvaluatedMesh:
    return EvaluatedMesh(
        mesh.name,
        *mesh.channels_at(times),
        lambda frames: mesh.points_at(times[frames]),
        lambda frames: mesh.normals_at(times[frames]),
        lambda: mesh.sums_at(times),
    )
