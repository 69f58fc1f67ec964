"""The certificate of a conversion between USD and glTF."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from usdface.advice import RAISING
from usdface.arrays import FloatArray
from usdface.certificate.certificate import Certificate
from usdface.certificate.compare import certify, match_names, sample_frames
from usdface.certificate.evaluated_mesh import EvaluatedMesh
from usdface.certificate.merge import merge_certificates
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.gltf.reference_player.deformed_mesh import PlayerMesh
from usdface.io.gltf.reference_player.evaluate import PlayerClip, evaluate_clips
from usdface.io.usd.clip_variants import clip_stages
from usdface.io.usd.errors import usd_errors
from usdface.io.usd.evaluate import UsdMesh, evaluate_usd, has_keys, stage_keys
from usdface.io.usd.metrics import metrics_of
from usdface.io.usd.stage import Stage
from usdface.io.usd.vertex_cache import is_cache_shape
from usdface.options import ExportOptions

__all__ = ["certify_conversion"]

_QUICK = 500_000  # vertices over all frames: a fraction of a second
_NOT_EVALUATED = (ArithmeticError, InputError, LookupError, MemoryError, TypeError, ValueError)
_NEAR = 1e-6  # of a time, and of a second: 8 roundings of float32


def certify_conversion(
    stage: Stage,
    gltf: Path,
    *,
    exported: bool,
    every_frame: bool,
    options: ExportOptions = ExportOptions(),
    asset_root: Path | None = None,
) -> tuple[Certificate | None, list[Finding]]:
    """Compare a stage, evaluated by UsdSkel, with a glTF, evaluated by the reference player.

    In each clip; clips belong together by name, or by place where there are equally many. The
    moments are all keys of the file, and those of the stage that it lacks; where a curve is cubic,
    also the middles between these.

    Parameters
    ----------
    stage : Stage
    gltf : Path
    exported : bool
        The stage is the source; else the file is.
    every_frame : bool
        Compare vertices at all moments, else at as many as take a fraction of a second.
    options : ExportOptions
        Of an export; `clip`, `purpose` and `influences` have an effect. The difference that fewer
        influences make by themselves is in the errors, but no warning.
    asset_root : Path, optional
        A folder that buffers of the file may come from beside its own.

    Returns
    -------
    Certificate or None
        None where the file has features that the evaluator does not support.
    list of Finding
    """
    try:
        with usd_errors(stage.GetRootLayer().realPath):
            shown = evaluate_clips(gltf, asset_root)
            certificate = _certificate(stage, shown, exported, every_frame, options)
    except Exception as error:  # of any kind: the written file does not depend on it
        if RAISING.get() and not isinstance(error, _NOT_EVALUATED):
            raise
        message = "not compared with its source: {error}"
        return None, [finding("CONVERSION_UNCERTIFIED", gltf.name, message, error)]
    where = gltf.name if exported else Path(stage.GetRootLayer().realPath).name
    return certificate, certificate.findings(where)


def _certificate(
    stage: Stage,
    shown: tuple[PlayerClip, ...],
    exported: bool,
    every_frame: bool,
    options: ExportOptions,
) -> Certificate:
    stages = list(clip_stages(stage))
    names = [stage_keys(staged)[0] for staged in stages]
    if len(stages) > 1:  # as one that stands still is none of several clips
        stages = [s for s in stages if has_keys(s)] or stages[:1]
        stages = [s for s in stages if options.clip in ("", stage_keys(s)[0])]
        names = [stage_keys(staged)[0] for staged in stages]
    pairs, missing = match_names(names, [clip.name for clip in shown], "clip ")
    budget = None if every_frame or not pairs else _QUICK // len(pairs)
    certificates = {
        names[i]: _clip_certificate(stages[i], shown[j], exported, budget, options)
        for i, j in pairs
    }
    decoded = any(clip.decoded for clip in shown)
    return replace(merge_certificates(certificates, missing), decoded=decoded)


def _clip_certificate(
    stage: Stage,
    shown: PlayerClip,
    exported: bool,
    budget: int | None,
    options: ExportOptions,
) -> Certificate:
    staged = evaluate_usd(stage, options.purpose)
    _, codes, stage_times = stage_keys(stage)
    gltf_times = shown.times if len(shown.times) else np.zeros(1)
    # Keys that only one side has, for a curve or an inbetween, change no time.
    drift = min(_time_drift(stage_times, gltf_times), _time_drift(gltf_times, stage_times))
    lacking = _lacking(gltf_times, stage_times)
    times = np.unique(np.concatenate([gltf_times, lacking]))
    if shown.cubic:  # the stage's lines meet the curve at its own keys, and miss it between them
        middles = (times[1:] + times[:-1]) / 2
        times = np.unique(np.concatenate([times, middles]))
    there = _nearest(stage_times, times)
    exact = np.abs(there - times) <= _near(times)
    rate = metrics_of(stage).time_codes_per_second
    start = codes[0] - stage_times[0] * rate
    at_keys = codes[np.searchsorted(stage_times, there)]
    moments = np.where(exact, at_keys, start + times * rate)
    usd = [_evaluated_usd(mesh, moments, options.influences) for mesh in staged]
    file = [_evaluated_gltf(mesh, times) for mesh in shown.meshes]
    if exported:
        cached = {mesh.name for mesh in staged if mesh.points_move}
        file = [_without_cache(mesh) if mesh.name in cached else mesh for mesh in file]
    vertices = sum(len(mesh.points) for mesh in shown.meshes)
    frames = sample_frames(
        len(times), vertices, vertices * len(times) if budget is None else budget
    )
    return certify(*((usd, file) if exported else (file, usd)), frames, drift, times)


def _time_drift(one: FloatArray, other: FloatArray) -> float:
    return float(np.abs(one - _nearest(other, one)).max(initial=0.0))


def _lacking(known: FloatArray, stage_times: FloatArray) -> FloatArray:
    """Return the keys of a stage that are not near a `known` one."""
    apart = np.abs(_nearest(known, stage_times) - stage_times)
    return np.asarray(stage_times[apart > _near(stage_times)])


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


def _evaluated_usd(mesh: UsdMesh, codes: FloatArray, influences: int = 0) -> EvaluatedMesh:
    requested = mesh.with_influences(influences)
    return EvaluatedMesh(
        mesh.name,
        mesh.shapes,
        mesh.weights_at(codes),
        lambda frames: mesh.points_at(codes[frames]),
        lambda frames: mesh.normals_at(codes[frames]),
        lambda frames: mesh.linear_morph_at(codes[frames]),
        requested=None if requested is None else _evaluated_usd(requested, codes),
    )


def _without_cache(mesh: EvaluatedMesh) -> EvaluatedMesh:
    """Return a mesh without the shapes that stand for its points over time, which show there."""
    kept = [k for k, name in enumerate(mesh.shapes) if not is_cache_shape(mesh.name, name)]
    shapes = tuple(mesh.shapes[k] for k in kept)
    return replace(mesh, shapes=shapes, weights=mesh.weights[:, kept])


def _evaluated_gltf(mesh: PlayerMesh, times: FloatArray) -> EvaluatedMesh:
    return EvaluatedMesh(
        mesh.name,
        *mesh.channels_at(times),
        lambda frames: mesh.points_at(times[frames]),
        lambda frames: mesh.normals_at(times[frames]),
        lambda frames: mesh.linear_morph_at(times[frames]),
        mesh.steps_at(times),
    )
