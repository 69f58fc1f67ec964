"""What a layer of ours holds: weights, head motion, emotions, authored as overs."""

from dataclasses import dataclass, field, replace

import numpy as np
from pxr import Gf, Sdf, Usd, UsdSkel, Vt

from usdface.cleanup.repairs import Repair
from usdface.errors import OutputError
from usdface.io.usd.head import author_head
from usdface.io.usd.shot import Shot, ShotPrims
from usdface.io.usd.stage import (
    matrices,
    to_si,
)
from usdface.retarget.align import Pose
from usdface.retarget.head_joint import matrices_of
from usdface.retarget.solution import Solution
from usdface.schemas import tokens
from usdface.takes import FloatArray

__all__ = ["Animation", "apply_animation", "author", "complete_weights"]

_ANIMATION = "UsdFaceAnim"


@dataclass(frozen=True, eq=False, slots=True)
class Animation:
    """What goes into one layer.

    Attributes
    ----------
    names : tuple of str, length T
        Blend shape tokens of the animation.
    weights : (F, T) float64
    solution : Solution or None
        Head pose, residual and feature points, for the solve layer.
    emotions : mapping of str to (F,) float64
        Emotion curves, for the express layer.
    firing : (F, R) float64 or None
        How far each rule fires, for the express layer.
    regions : mapping of str to (F,) float64 [m]
        The residual of each region of the face, for the solve layer.
    repairs : tuple of Repair
        What was cleaned before the solve, for the solve layer.
    motion : Pose or None
        How the character's head moves, if it is to move, for the solve layer.
    """

    names: tuple[str, ...]
    weights: FloatArray
    solution: Solution | None
    emotions: dict[str, FloatArray]
    repairs: tuple[Repair, ...] = ()
    motion: Pose | None = None
    firing: FloatArray | None = None
    regions: dict[str, FloatArray] = field(default_factory=dict)


def complete_weights(
    stage: Usd.Stage, shot: Shot, names: tuple[str, ...], weights: FloatArray
) -> tuple[tuple[str, ...], FloatArray]:
    """Bring solved weights (F, S) into the order of the rig's animation: (F, T).

    Tokens that were not solved keep what the animation has; shapes that the animation does
    not name yet are appended.
    """
    order = shot.prims.tokens + tuple(n for n in names if n not in shot.prims.tokens)
    result = np.zeros((len(weights), len(order)))
    if shot.prims.animation and set(order) - set(names):
        attribute = UsdSkel.Animation.Get(stage, shot.prims.animation).GetBlendShapeWeightsAttr()
        varying = attribute.ValueMightBeTimeVarying()
        count = len(shot.prims.tokens)
        for row, code in zip(result, shot.codes.tolist() if varying else [0.0], strict=False):
            value = attribute.Get(code)
            if value is not None and len(value) == count:
                row[:count] = value
        if not varying:
            result[1:] = result[0]
    place = {name: i for i, name in enumerate(order)}
    result[:, [place[name] for name in names]] = weights
    return order, result


def apply_animation(stage: Usd.Stage, shot: Shot, animation: Animation) -> None:
    """Author one animation as overs on the edit target of an open stage.

    Raises
    ------
    OutputError
        If the edit target cannot be edited, or is not among the stage's own layers.
    """
    layer = stage.GetEditTarget().GetLayer()
    if not (stage.HasLocalLayer(layer) and layer.permissionToEdit):
        raise OutputError(
            f"the edit target {layer.identifier} cannot take the animation: it must be one of "
            "the stage's own layers, and not locked"
        )
    # USD stretches what lies on a layer by the ratio of its clock to the stage's.
    offset = stage.GetEditTargetForLocalLayer(layer).GetMapFunction().timeOffset.GetInverse()
    codes = np.array([offset * code for code in shot.codes.tolist()])
    author(layer, stage, replace(shot, codes=codes), animation, shot.codes.tolist())


def author(
    layer: Sdf.Layer,
    stage: Usd.Stage,
    shot: Shot,
    animation: Animation,
    at: list[float] | None = None,
) -> None:
    """Author one animation of a stage's shot as overs on a layer.

    `at` are the stage's time codes of the frames, where those of the layer, `shot.codes`, differ.
    """
    prims, codes = shot.prims, shot.codes.tolist()
    with Sdf.ChangeBlock():
        anim = Sdf.CreatePrimInLayer(layer, prims.animation or f"{prims.skel_root}/{_ANIMATION}")
        if not prims.animation:
            _define_animation(layer, anim, prims)
        if animation.names != prims.tokens:
            _attribute(
                anim, "blendShapes", Sdf.ValueTypeNames.TokenArray, uniform=True
            ).default = Vt.TokenArray(animation.names)
        _attribute(anim, "blendShapeWeights", Sdf.ValueTypeNames.FloatArray)
        rows = animation.weights.astype(np.float32)
        _samples(layer, anim, "blendShapeWeights", codes, map(Vt.FloatArray.FromNumpy, rows))
        if animation.solution is not None:
            _author_solution(layer, shot, animation.solution, animation.regions)
        if animation.motion is not None and prims.head is not None:
            author_head(
                layer,
                stage,
                (prims.skel_root, str(anim.path)),
                prims.head,
                animation.motion,
                codes,
                at or codes,
            )
        if animation.repairs:
            _author_repairs(layer, shot, animation.repairs)
        if animation.emotions:
            system = Sdf.CreatePrimInLayer(layer, prims.fuzzy)
            for name, curve in animation.emotions.items():
                _attribute(system, tokens.EMOTION_PREFIX + name, Sdf.ValueTypeNames.Float)
                _samples(layer, system, tokens.EMOTION_PREFIX + name, codes, _floats(curve))
            if animation.firing is not None:
                fired = animation.firing.astype(np.float32)
                _attribute(system, tokens.FIRING, Sdf.ValueTypeNames.FloatArray)
                _samples(layer, system, tokens.FIRING, codes, map(Vt.FloatArray.FromNumpy, fired))


def _author_repairs(layer: Sdf.Layer, shot: Shot, repairs: tuple[Repair, ...]) -> None:
    prim, names = Sdf.CreatePrimInLayer(layer, shot.prims.retarget), Sdf.ValueTypeNames
    spans = Vt.Vec2iArray([Gf.Vec2i(r.first, r.last) for r in repairs])
    for name, kind, value in (
        (
            tokens.CLEAN_REPAIRS_MARKERS,
            names.TokenArray,
            Vt.TokenArray([r.marker for r in repairs]),
        ),
        (tokens.CLEAN_REPAIRS_FRAMES, names.Int2Array, spans),
        (tokens.CLEAN_REPAIRS_KINDS, names.TokenArray, Vt.TokenArray([r.kind for r in repairs])),
    ):
        _attribute(prim, name, kind, uniform=True).default = value


def _define_animation(layer: Sdf.Layer, anim: Sdf.PrimSpec, prims: ShotPrims) -> None:
    anim.specifier, anim.typeName = Sdf.SpecifierDef, "SkelAnimation"
    for path in dict.fromkeys((prims.skel_root, prims.skeleton)):
        owner = Sdf.CreatePrimInLayer(layer, path)
        source = Sdf.RelationshipSpec(owner, "skel:animationSource", custom=False)
        source.targetPathList.explicitItems = [anim.path]


def _attribute(
    prim: Sdf.PrimSpec, name: str, kind: Sdf.ValueTypeName, uniform: bool = False
) -> Sdf.AttributeSpec:
    existing = prim.attributes.get(name)
    variability = Sdf.VariabilityUniform if uniform else Sdf.VariabilityVarying
    return existing or Sdf.AttributeSpec(prim, name, kind, variability)


def _samples(
    layer: Sdf.Layer, prim: Sdf.PrimSpec, name: str, codes: list[float], values: object
) -> None:
    path = prim.path.AppendProperty(name)
    for code, value in zip(codes, values, strict=True):  # type: ignore[call-overload]
        layer.SetTimeSample(path, code, value)


def _floats(values: FloatArray) -> list[float]:
    # Through float32, so that the same curve always gives the same bytes.
    return [float(v) for v in values.astype(np.float32)]


def _author_solution(
    layer: Sdf.Layer, shot: Shot, solution: Solution, regions: dict[str, FloatArray]
) -> None:
    prim = Sdf.CreatePrimInLayer(layer, shot.prims.retarget)
    codes = shot.codes.tolist()
    unit = shot.metrics.meters_per_unit
    _attribute(prim, tokens.RESIDUAL, Sdf.ValueTypeNames.Float)
    _samples(layer, prim, tokens.RESIDUAL, codes, _floats(solution.residual / unit))
    for region, curve in regions.items():
        name = tokens.RESIDUAL_PREFIX + region
        _attribute(prim, name, Sdf.ValueTypeNames.Float)
        _samples(layer, prim, name, codes, _floats(curve / unit))
    to_stage = np.linalg.inv(to_si(shot.metrics))
    pose = matrices_of(solution.pose)
    if solution.in_space:
        pose = to_si(shot.metrics) @ pose @ to_stage
    _attribute(prim, tokens.HEAD_TRANSFORM, Sdf.ValueTypeNames.Matrix4d)
    _samples(layer, prim, tokens.HEAD_TRANSFORM, codes, matrices(pose))
    _attribute(prim, tokens.FEATURE_POINTS, Sdf.ValueTypeNames.Point3fArray)
    features = (solution.feature_points @ to_stage[:3, :3]).astype(np.float32)
    _samples(layer, prim, tokens.FEATURE_POINTS, codes, map(Vt.Vec3fArray.FromNumpy, features))
