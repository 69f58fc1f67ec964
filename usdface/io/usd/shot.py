"""Reading a shot from a USD stage with a character, a take and their setup."""

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from pxr import Sdf, Usd, UsdSkel

from usdface.arrays import FloatArray, IntArray
from usdface.errors import InputError
from usdface.face.own_names import report_counted_names
from usdface.face.plain_names import report_affixes
from usdface.findings import Finding, finding
from usdface.io.usd.errors import usd_errors
from usdface.io.usd.expressions import read_expressions
from usdface.io.usd.face_layout import read_exaggeration, read_gains, read_layout
from usdface.io.usd.front_facing_rig import front_facing_rig
from usdface.io.usd.fuzzy import read_fuzzy
from usdface.io.usd.head_motion import HeadCarrier, find_carrier
from usdface.io.usd.ignored_attributes import ignored_attributes
from usdface.io.usd.metrics import Metrics, metrics_of, missing_metrics, to_si
from usdface.io.usd.mixed_metrics import report_mixed_sublayer
from usdface.io.usd.pins import read_pins
from usdface.io.usd.retarget_setup import check_neutral, read_setup
from usdface.io.usd.skel_bindings import active_skeleton, active_source
from usdface.io.usd.stage import check_clocks, open_stage
from usdface.io.usd.take import count_frames, read_take_prim
from usdface.rigs import Rig
from usdface.schemas import tokens
from usdface.setup.assumed_mesh import assumed_mesh_findings
from usdface.setup.binding_origin import check_mesh
from usdface.shot.shot import Shot
from usdface.takes import MarkerTake, WeightsTake

__all__ = [
    "ShotPrims",
    "StagedShot",
    "base_weights",
    "read_character",
    "read_shot",
    "shot_frames",
]


@dataclass(frozen=True, slots=True)
class ShotPrims:
    """Prim paths of a shot on its stage; "" = none.

    `tokens` are the blend shape names of the animation, in its order; `head` is the joint, or the
    SkelRoot, that moves with the head.
    """

    retarget: str
    skeleton: str
    skel_root: str
    animation: str
    fuzzy: str
    tokens: tuple[str, ...]
    head: HeadCarrier | None = field(compare=False)


@dataclass(frozen=True, eq=False, slots=True)
class StagedShot:
    """A shot and its prims on a stage.

    Attributes
    ----------
    stage : Usd.Stage
    shot : Shot
        In metres, seconds, Y up.
    prims : ShotPrims
    codes : (F,) float64
        Time codes of the take's frames on the stage.
    metrics : Metrics
        Of the stage.
    to_rig : (4, 4) float64
        From stage space to that of the rig, which looks along +z.
    """

    stage: Usd.Stage
    shot: Shot
    prims: ShotPrims
    codes: FloatArray
    metrics: Metrics
    to_rig: FloatArray


def read_character(path: Path) -> tuple[Rig, list[Finding]]:
    """Read the rig of a new shot, from a file that is no shot itself.

    Raises
    ------
    InputError
        If it has a `UsdFaceRetarget` prim: a shot of it would have two. Or as
        `usdface.io.usd.rig.rig_of_stage`.
    """
    stage = open_stage(path)
    with usd_errors(str(path)):
        setups = _retarget_prims(stage)
    if setups:
        raise InputError(
            f"{path} is a shot, or a result of one: it has the {tokens.RETARGET} prim "
            f"{setups[0].GetPath()}; expected a character without one. Name the file of the rig "
            "itself, from which that shot was made",
            "SHOT_AS_RIG",
        )
    rig, _, findings = front_facing_rig(stage)
    return rig, [*findings, *report_counted_names(rig), *report_affixes(rig)]


def read_shot(
    stage: Usd.Stage,
    where: str,
    asset_root: Path | None = None,
    frames: IntArray | None = None,
) -> tuple[StagedShot, list[Finding]]:
    """Read the shot of a stage, which has one setup; textures may also come from `asset_root`.

    With `frames` (F,) its take and all that varies over it are of these frames alone; the neutral
    frames of the setup still count from the first frame of the take.

    Raises
    ------
    InputError
        If there is no `UsdFaceRetarget` prim or more than one, or a target of it is missing.
    """
    with usd_errors(where):
        return _read(stage, where, asset_root, frames)


def shot_frames(stage: Usd.Stage, where: str) -> int:
    """Return how many frames the take of a shot has.

    Raises
    ------
    InputError
        If there is no `UsdFaceRetarget` prim or more than one, or it has no take.
    """
    with usd_errors(where):
        return count_frames(_take_prim(stage, _retarget_prim(stage, where), where))


def _read(
    stage: Usd.Stage, where: str, asset_root: Path | None, frames: IntArray | None
) -> tuple[StagedShot, list[Finding]]:
    check_clocks(stage)  # also of one that a host has opened
    prim = _retarget_prim(stage, where)
    setup = read_setup(prim)
    take_prim = _take_prim(stage, prim, where)
    take, codes = read_take_prim(take_prim, frames)
    count = len(codes) if frames is None else count_frames(take_prim)
    check_neutral(prim, setup, take, count)
    scope = prim.GetRelationship(tokens.RIG).GetTargets()
    root = str(scope[0]) if scope else ""
    rig, turn, findings = front_facing_rig(
        stage,
        root,
        joints=True,
        asset_root=asset_root,
        mesh=setup.binding.mesh,
        markers=setup.binding.points,
    )
    pins, pin_findings = read_pins(prim, rig.shape_names, codes)
    setup, findings = replace(setup, pins=pins), findings + pin_findings + missing_metrics(stage)
    fuzzy = prim.GetRelationship(tokens.SYSTEM).GetTargets()
    system = read_fuzzy(stage, str(fuzzy[0])) if fuzzy else None
    posed = [
        _existing_prim(stage, path, tokens.EXPRESSIONS, where)
        for path in prim.GetRelationship(tokens.EXPRESSIONS).GetTargets()
    ]
    posed = [expression for expression in posed if expression.IsActive()]
    expressions = read_expressions(posed)
    metrics = metrics_of(stage)
    layout = read_layout(prim, metrics.meters_per_unit)
    gains = read_gains(stage.GetPrimAtPath(fuzzy[0]) if fuzzy else None, posed, codes)
    mesh = rig.mesh(setup.binding.mesh)
    if assumed := assumed_mesh_findings(rig, setup.binding, str(prim.GetPath()), shot=True):
        findings += assumed
        setup = replace(setup, binding=replace(setup.binding, mesh=mesh.path))
    if setup.origin is not None:
        check_mesh(setup.origin, mesh)
    prims = _prims_of(stage, mesh.path, str(prim.GetPath()), str(fuzzy[0]) if fuzzy else "", where)
    prims_of_head = stage.GetPrimAtPath(prims.skeleton), stage.GetPrimAtPath(prims.skel_root)
    to_rig = to_si(metrics) @ turn
    head = find_carrier(mesh, rig.skeleton, setup, *prims_of_head, to_rig)
    findings += report_mixed_sublayer(stage, prim)
    if not prims.animation:
        findings.append(finding("ANIMATION_CREATED", prims.skeleton))
    prims = replace(prims, head=head)
    usdface_prims = [prim, take_prim, *posed, *(stage.GetPrimAtPath(path) for path in fuzzy)]
    scopes = dict.fromkeys(each.GetParent() for each in posed)
    findings += ignored_attributes([*usdface_prims, *scopes])
    base = base_weights(stage, prims, take, codes)
    exaggeration = read_exaggeration(prim, codes)
    shot = Shot(rig, take, setup, system, expressions, layout, gains, base, exaggeration)
    return StagedShot(stage, shot, prims, codes, metrics, to_rig), findings


def _retarget_prims(stage: Usd.Stage) -> list[Usd.Prim]:
    return [p for p in stage.Traverse() if _is_retarget(p)]


def _is_retarget(prim: Usd.Prim) -> bool:
    return bool(prim.GetTypeName() == tokens.RETARGET)


def _retarget_prim(stage: Usd.Stage, where: str) -> Usd.Prim:
    found = _retarget_prims(stage)
    if len(found) == 1:
        return found[0]
    paths = ", ".join(str(p.GetPath()) for p in found)
    remedy = "name the file of one of them" if found else "`usdface shot` makes such a file"
    proxies = Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate))
    inside = None if found else next((p for p in proxies if _is_retarget(p)), None)
    if inside:
        remedy = (
            f"{inside.GetPath()} is inside an instance, which no layer can animate: set "
            "instanceable = false on it"
        )
    raise InputError(
        f"{where} has {len(found)} {tokens.RETARGET} prims{': ' if found else ''}{paths}; "
        f"expected one; {remedy}",
        "SHOT_INCOMPLETE",
    )


def base_weights(
    stage: Usd.Stage, prims: ShotPrims, take: MarkerTake | WeightsTake, codes: FloatArray
) -> WeightsTake | None:
    """Return the authored weights of the animation at the frames of the take; 0 without a value."""
    if not prims.animation or not prims.tokens:
        return None
    attribute = UsdSkel.Animation.Get(stage, prims.animation).GetBlendShapeWeightsAttr()
    weights = np.zeros((len(codes), len(prims.tokens)))
    varying = attribute.ValueMightBeTimeVarying()
    for row, code in zip(weights, codes.tolist() if varying else [0.0], strict=False):
        value = attribute.Get(code)
        if value is not None and len(value) == len(row):
            row[:] = value
    if not varying:
        weights[1:] = weights[0]
    return WeightsTake(prims.tokens, take.times, weights, take.rate)


def _take_prim(stage: Usd.Stage, prim: Usd.Prim, where: str) -> Usd.Prim:
    targets = prim.GetRelationship(tokens.TAKE).GetTargets()
    if not targets:
        raise InputError(
            f"{where}, prim <{prim.GetPath()}>: {tokens.TAKE} has no target", "SHOT_INCOMPLETE"
        )
    return _existing_prim(stage, targets[0], tokens.TAKE, where)


def _existing_prim(stage: Usd.Stage, path: Sdf.Path, name: str, where: str) -> Usd.Prim:
    prim = stage.GetPrimAtPath(path)
    if not prim:
        raise InputError(
            f"{where}: {name} points at <{path}>, which is not on the stage; "
            "is a referenced file missing?",
            "SHOT_INCOMPLETE",
        )
    return prim


def _prims_of(stage: Usd.Stage, mesh: str, retarget: str, fuzzy: str, where: str) -> ShotPrims:
    """Find the skeleton and the animation that deform `mesh`."""
    prim = stage.GetPrimAtPath(mesh)
    if prim.IsInstanceProxy():
        raise InputError(
            f"{where}: mesh <{mesh}> is inside an instance, which no layer can animate; "
            "set instanceable = false on it in the shot"
        )
    skeleton = active_skeleton(prim)
    if skeleton is None:
        raise InputError(
            f"{where}: mesh <{mesh}> has no active skel:skeleton, so USD would not play its blend "
            "shapes; activate it, or let `usdface rig` write a rig that has one"
        )
    found = UsdSkel.Root.Find(prim)
    root = found.GetPrim() if found else None
    animation = active_source(skeleton)
    names = UsdSkel.Animation(animation).GetBlendShapesAttr().Get() if animation else None
    return ShotPrims(
        retarget,
        str(skeleton.GetPath()),
        str(root.GetPath()) if root else "",
        str(animation.GetPath()) if animation else "",
        fuzzy,
        tuple(str(name) for name in names or ()),
        None,
    )
