"""The content of a layer of a result authored as overs."""

import json
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from pxr import Gf, Sdf, Usd, Vt

from usdface.arrays import FloatArray
from usdface.cleanup.repairs import Repair
from usdface.errors import OutputError
from usdface.findings import Finding
from usdface.io.usd.animation import Animation, Inputs
from usdface.io.usd.animation_source import define_animation
from usdface.io.usd.head_motion import author_head
from usdface.io.usd.layer_samples import write_arrays, write_samples, write_value
from usdface.io.usd.metrics import to_si
from usdface.io.usd.overs import put_overs
from usdface.io.usd.shot import ShotPrims, StagedShot
from usdface.io.usd.stronger_opinions import hidden_by
from usdface.io.usd.value_arrays import matrices
from usdface.numerics.frame_blocks import frame_blocks
from usdface.retarget.joint_motion import matrices_of
from usdface.retarget.solution import Solution
from usdface.schemas import tokens
from usdface.verdict.judge import Verdict

__all__ = [
    "OCCLUDED_INPUT",
    "animation_path",
    "apply_animation",
    "author",
    "editable_layer",
]

_ANIMATION = "UsdFaceAnim"
_NAMES = Sdf.ValueTypeNames

# Results are finite: programs that draw curves do not expect other numbers.
_OCCLUDED_DISTANCE = -1.0

OCCLUDED_INPUT = float(np.finfo(np.float32).min)

_RESULTS = (
    *(tokens.RESIDUAL, tokens.HEAD_TRANSFORM, tokens.FEATURE_POINTS, tokens.FIRING),
    *(tokens.CLOSURE_LEFT_EYE, tokens.CLOSURE_RIGHT_EYE, tokens.CLOSURE_MOUTH),
    *(tokens.CLEAN_REPAIRS_MARKERS, tokens.CLEAN_REPAIRS_FRAMES, tokens.CLEAN_REPAIRS_KINDS),
    *(tokens.SOLVED_MARKERS, tokens.SOLVED_DISTANCES, tokens.SOLVED_SHAPES, tokens.VERDICT),
    *(tokens.SOLVED_DEVIATIONS, tokens.INPUTS, tokens.INPUTS_UNIT),
)


def animation_path(prims: ShotPrims) -> str:
    """Return the path of the SkelAnimation that results are authored on; it may be made there."""
    return prims.animation or f"{prims.skel_root}/{_ANIMATION}"


def apply_animation(shot: StagedShot, animation: Animation) -> list[Finding]:
    """Author one animation as overs on the edit target of an open stage, all of it or nothing.

    Properties of an earlier result that this one lacks are removed.

    Returns
    -------
    list of Finding
        ATTRIBUTE_REPLACED, RESULT_HIDDEN.

    Raises
    ------
    OutputError
        If the edit target cannot be edited, or is not among the stage's own layers.
    """
    layer = editable_layer(shot.stage)
    # USD scales the time codes of a layer by the ratio of its timeCodesPerSecond to the stage's.
    offset = shot.stage.GetEditTargetForLocalLayer(layer).GetMapFunction().timeOffset.GetInverse()
    codes = np.array([offset * code for code in shot.codes.tolist()])
    overs = Sdf.Layer.CreateAnonymous(".usda")
    author(overs, replace(shot, codes=codes), animation, shot.codes.tolist())
    return put_overs(overs, shot.stage, _is_result) + hidden_by(overs, shot.stage)


def _is_result(name: str) -> bool:
    """Return whether only results have a property of this name."""
    return name in _RESULTS or name.startswith((tokens.EMOTION_PREFIX, tokens.RESIDUAL_PREFIX))


def editable_layer(stage: Usd.Stage) -> Sdf.Layer:
    """Return the layer of a stage's edit target.

    Raises
    ------
    OutputError
        If it is locked, or none of the stage's own layers.
    """
    layer = stage.GetEditTarget().GetLayer()
    if not (stage.HasLocalLayer(layer) and layer.permissionToEdit):
        raise OutputError(
            f"the edit target {layer.identifier} cannot be authored on: it must be one of the "
            "stage's own layers, and not locked"
        )
    return layer


def author(
    layer: Sdf.Layer,
    shot: StagedShot,
    animation: Animation,
    stage_codes: list[float] | None = None,
) -> None:
    """Author one animation of a stage's shot as overs on a layer.

    `stage_codes` are the frames' time codes on the stage, if those on the layer differ.
    """
    prims, codes = shot.prims, shot.codes.tolist()
    with Sdf.ChangeBlock():
        anim = Sdf.CreatePrimInLayer(layer, animation_path(prims))
        if not prims.animation:
            define_animation(layer, shot.stage, anim, prims)
        if animation.names != prims.tokens:
            write_value(anim, "blendShapes", _NAMES.TokenArray, Vt.TokenArray(animation.names))
        write_arrays(anim, "blendShapeWeights", _NAMES.FloatArray, shot.codes, animation.weights)
        if animation.solution is not None:
            _author_solution(layer, shot, animation.solution, animation.regions)
        if animation.deviations:
            _author_deviations(layer, shot, animation.deviations)
        if animation.verdict is not None:
            _author_verdict(layer, shot, animation.verdict)
        if prims.head is not None:
            author_head(
                layer,
                shot.stage,
                (prims.skel_root, str(anim.path)),
                prims.head,
                animation.motion,
                animation.eyes,
                codes,
                stage_codes or codes,
            )
        for name, curve in animation.closure.items():
            prim = Sdf.CreatePrimInLayer(layer, prims.retarget)
            write_samples(prim, name, _NAMES.Float, codes, _floats(curve))
        if animation.repairs:
            _author_repairs(layer, shot, animation.repairs)
        if animation.emotions:
            _author_expressions(layer, shot, animation)


def _author_expressions(layer: Sdf.Layer, shot: StagedShot, animation: Animation) -> None:
    system, codes = Sdf.CreatePrimInLayer(layer, shot.prims.fuzzy), shot.codes.tolist()
    for name, curve in animation.emotions.items():
        write_samples(system, tokens.EMOTION_PREFIX + name, _NAMES.Float, codes, _floats(curve))
    if animation.firing is not None:
        write_arrays(system, tokens.FIRING, _NAMES.FloatArray, shot.codes, animation.firing)
    if animation.inputs is not None:
        _author_inputs(system, animation.inputs, shot)


def _author_inputs(system: Sdf.PrimSpec, inputs: Inputs, shot: StagedShot) -> None:
    rows = np.where(np.isnan(inputs.values), OCCLUDED_INPUT, inputs.values)
    write_arrays(system, tokens.INPUTS, _NAMES.FloatArray, shot.codes, rows)
    unit = inputs.unit / shot.metrics.meters_per_unit
    write_value(system, tokens.INPUTS_UNIT, _NAMES.Double, unit)


def _author_repairs(layer: Sdf.Layer, shot: StagedShot, repairs: tuple[Repair, ...]) -> None:
    prim = Sdf.CreatePrimInLayer(layer, shot.prims.retarget)
    spans = Vt.Vec2iArray([Gf.Vec2i(r.first, r.last) for r in repairs])
    markers = Vt.TokenArray([r.marker for r in repairs])
    kinds = Vt.TokenArray([r.kind for r in repairs])
    write_value(prim, tokens.CLEAN_REPAIRS_MARKERS, _NAMES.TokenArray, markers)
    write_value(prim, tokens.CLEAN_REPAIRS_FRAMES, _NAMES.Int2Array, spans)
    write_value(prim, tokens.CLEAN_REPAIRS_KINDS, _NAMES.TokenArray, kinds)


def _floats(values: FloatArray) -> list[float]:
    # Through float32, so that the same curve always gives the same bytes.
    return [float(v) for v in values.astype(np.float32)]


def _author_solution(
    layer: Sdf.Layer, shot: StagedShot, solution: Solution, regions: Mapping[str, FloatArray]
) -> None:
    prim = Sdf.CreatePrimInLayer(layer, shot.prims.retarget)
    codes = shot.codes.tolist()
    unit = shot.metrics.meters_per_unit
    write_samples(prim, tokens.RESIDUAL, _NAMES.Float, codes, _floats(solution.residual / unit))
    for region, curve in regions.items():
        name = tokens.RESIDUAL_PREFIX + region
        write_samples(prim, name, _NAMES.Float, codes, _floats(curve / unit))
    pose = matrices_of(solution.pose)
    if solution.posed_in_space:
        pose = to_si(shot.metrics) @ pose @ np.linalg.inv(to_si(shot.metrics))
    write_samples(prim, tokens.HEAD_TRANSFORM, _NAMES.Matrix4d, codes, matrices(pose))
    to_stage = np.linalg.inv(shot.to_rig)
    for frames in frame_blocks(len(codes)):
        points = solution.feature_points[frames] @ to_stage[:3, :3]
        kind = _NAMES.Point3fArray
        write_arrays(prim, tokens.FEATURE_POINTS, kind, shot.codes[frames], points)
    markers = Vt.TokenArray(solution.markers)
    write_value(prim, tokens.SOLVED_MARKERS, _NAMES.TokenArray, markers)
    for frames in frame_blocks(len(codes)):
        distances = solution.distances[frames]
        distances = np.where(np.isnan(distances), _OCCLUDED_DISTANCE, distances / unit)
        kind = _NAMES.FloatArray
        write_arrays(prim, tokens.SOLVED_DISTANCES, kind, shot.codes[frames], distances)


def _author_verdict(layer: Sdf.Layer, shot: StagedShot, verdict: Verdict) -> None:
    prim = Sdf.CreatePrimInLayer(layer, shot.prims.retarget)
    text = json.dumps(verdict.as_dict(), ensure_ascii=False)
    write_value(prim, tokens.VERDICT, _NAMES.String, text)


def _author_deviations(layer: Sdf.Layer, shot: StagedShot, deviations: Mapping[str, float]) -> None:
    prim = Sdf.CreatePrimInLayer(layer, shot.prims.retarget)
    shapes, values = Vt.TokenArray(list(deviations)), Vt.FloatArray(list(deviations.values()))
    write_value(prim, tokens.SOLVED_SHAPES, _NAMES.TokenArray, shapes)
    write_value(prim, tokens.SOLVED_DEVIATIONS, _NAMES.FloatArray, values)
