"""The shot: a stage that brings a character, a take and their setup together."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdSkel

from usdface.arrays import FloatArray
from usdface.correction.gains import Gains
from usdface.errors import InputError
from usdface.expression_system import ExpressionSystem
from usdface.face.layout import FaceParts
from usdface.findings import Finding, finding
from usdface.io.usd.errors import usd_errors
from usdface.io.usd.face_layout import read_gains, read_parts, write_parts
from usdface.io.usd.fuzzy import read_fuzzy, write_fuzzy
from usdface.io.usd.head_motion import HeadCarrier, find_carrier
from usdface.io.usd.ignored_attributes import unread_settings
from usdface.io.usd.pins import read_pins
from usdface.io.usd.retarget_setup import (
    read_expressions,
    read_setup,
    write_expressions,
    write_setup,
)
from usdface.io.usd.rig import rig_of_stage
from usdface.io.usd.stage import (
    Metrics,
    default_prim,
    matrices,
    metrics_of,
    new_stage,
    open_stage,
    relative_asset,
    save_layer,
    to_si,
    unsaid_metrics,
)
from usdface.io.usd.take import read_take_prim
from usdface.retarget_setup import Expression, RetargetSetup
from usdface.rigs import Rig
from usdface.schemas import tokens, write_fallback_types
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["Shot", "ShotPrims", "read_shot", "write_shot"]

_CHARACTER = "/Shot/Character"
_CAPTURE = "/Shot/Capture"
_TAKE = "/Shot/Capture/Take"


@dataclass(frozen=True, slots=True)
class ShotPrims:
    """Where things are on the stage: prim paths, "" = not there.

    `tokens` are the blend shape names of the animation, in its order; `head` is what moves where
    the head does.
    """

    retarget: str
    skeleton: str
    skel_root: str
    animation: str
    fuzzy: str
    tokens: tuple[str, ...]
    head: HeadCarrier | None = field(compare=False)


@dataclass(frozen=True, eq=False, slots=True)
class Shot:
    """Everything `process` reads from a stage; `codes` (F,) are the take's time codes on it."""

    take: MarkerTake | WeightsTake
    codes: FloatArray
    rig: Rig
    setup: RetargetSetup
    system: ExpressionSystem | None
    expressions: tuple[Expression, ...]
    prims: ShotPrims
    metrics: Metrics
    parts: FaceParts = field(default_factory=FaceParts)
    gains: Gains = field(default_factory=Gains)


def write_shot(
    path: Path,
    rig: Path,
    take: Path,
    setup: RetargetSetup,
    system: ExpressionSystem | None,
    expressions: Sequence[Expression],
    parts: FaceParts | None = None,
) -> None:
    """Write a shot that references `rig` and `take` and holds the setup.

    Units and up axis are the rig's, the clock is the take's. `setup.binding.mesh` is a prim
    path on the rig's own stage.

    Raises
    ------
    InputError
        If rig or take cannot be opened.
    OutputError
        If the shot cannot be written.
    """
    rig_stage, take_stage = open_stage(rig), open_stage(take)
    character = _root_of(rig_stage, rig)
    stage = _stage_of(metrics_of(rig_stage), metrics_of(take_stage))
    targets = {tokens.TAKE: [_TAKE]}
    mesh = setup.binding.mesh
    if mesh:
        targets[tokens.BIND_MESH] = [_referenced(mesh, character, rig)]
        root = _skel_root(rig_stage.GetPrimAtPath(mesh))
        targets |= {tokens.RIG: [_referenced(root, character, rig)]} if root else {}
    if system is not None:
        write_fuzzy(stage, "/Shot/Fuzzy", system)
        targets[tokens.SYSTEM] = ["/Shot/Fuzzy"]
    if expressions:
        targets[tokens.EXPRESSIONS] = write_expressions(stage, "/Shot/Expressions", expressions)
    write_setup(stage, "/Shot/Retarget", setup, targets)
    if parts is not None:
        unit = metrics_of(stage).meters_per_unit
        write_parts(stage.GetPrimAtPath("/Shot/Retarget"), parts, unit)
    # On a layer that no stage composes, because the paths are relative to where it will lie.
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.TransferContent(stage.GetRootLayer())
    for place, asset, root in (
        (_CHARACTER, rig, character),
        (_TAKE, take, str(default_prim(take_stage, take).GetPath())),
    ):
        prim = Sdf.CreatePrimInLayer(layer, place)
        prim.specifier = Sdf.SpecifierDef
        prim.referenceList.prependedItems = [Sdf.Reference(relative_asset(asset, path), root)]
    write_fallback_types(layer)
    save_layer(layer, path)


def _stage_of(rig: Metrics, take: Metrics) -> Usd.Stage:
    """Make a stage in the rig's space on the take's clock, with a place for the take."""
    stage = new_stage(
        replace(take, meters_per_unit=rig.meters_per_unit, up_axis=rig.up_axis), "Shot"
    )
    # The units of the take are put right on a parent, which every reader of USD understands.
    capture = UsdGeom.Xform.Define(stage, _CAPTURE)
    matrix = to_si(take) @ np.linalg.inv(to_si(rig))
    if not np.allclose(matrix, np.eye(4), rtol=0, atol=1e-12):
        capture.AddTransformOp().Set(matrices(matrix)[0])
    return stage


def _referenced(prim: str, character: str, rig: Path) -> str:
    """Return where a prim of the rig's own stage is once the shot references `character`."""
    if not Sdf.Path(prim).HasPrefix(character):
        raise InputError(
            f"{rig}: <{prim}> is not under the defaultPrim <{character}>, which the shot references"
        )
    return str(Sdf.Path(prim).ReplacePrefix(Sdf.Path(character), Sdf.Path(_CHARACTER)))


def _root_of(stage: Usd.Stage, path: Path) -> str:
    if stage.GetDefaultPrim():
        return str(stage.GetDefaultPrim().GetPath())
    for prim in stage.TraverseAll():
        if prim.IsA(UsdSkel.Root):
            return str(prim.GetPath().GetPrefixes()[0])
    raise InputError(
        f"{path} has neither a defaultPrim nor a SkelRoot to reference", "DEFAULT_PRIM_MISSING"
    )


def _skel_root(prim: Usd.Prim) -> str:
    root = UsdSkel.Root.Find(prim) if prim else None
    return str(root.GetPath()) if root else ""


def read_shot(
    stage: Usd.Stage, where: str, asset_root: Path | None = None
) -> tuple[Shot, list[Finding]]:
    """Read the one face that a stage sets up; textures may also come from `asset_root`.

    Raises
    ------
    InputError
        If there is no `UsdFaceRetarget` prim or more than one, or what it names is missing.
    """
    with usd_errors(where):
        return _read(stage, where, asset_root)


def _read(stage: Usd.Stage, where: str, asset_root: Path | None) -> tuple[Shot, list[Finding]]:
    found = [p for p in stage.Traverse() if p.GetTypeName() == tokens.RETARGET]
    if len(found) != 1:
        paths = ", ".join(str(p.GetPath()) for p in found)
        raise InputError(
            f"{where} has {len(found)} {tokens.RETARGET} prims{': ' if found else ''}{paths}; "
            "expected one. `usdface shot` makes such a file",
            "SHOT_INCOMPLETE",
        )
    prim = found[0]
    setup = read_setup(prim)
    take_prim = _target(stage, prim, tokens.TAKE, where)
    take, codes = read_take_prim(take_prim)
    scope = prim.GetRelationship(tokens.RIG).GetTargets()
    rig, findings = rig_of_stage(stage, str(scope[0]) if scope else "", True, asset_root)
    pins, notes = read_pins(prim, rig.shape_names, codes)
    setup, findings = replace(setup, pins=pins), findings + notes + unsaid_metrics(stage)
    fuzzy = prim.GetRelationship(tokens.SYSTEM).GetTargets()
    system = read_fuzzy(stage, str(fuzzy[0])) if fuzzy else None
    posed = [
        _there(stage, path, tokens.EXPRESSIONS, where)
        for path in prim.GetRelationship(tokens.EXPRESSIONS).GetTargets()
    ]
    expressions = read_expressions(posed)
    metrics = metrics_of(stage)
    parts = read_parts(prim, metrics.meters_per_unit)
    gains = read_gains(stage.GetPrimAtPath(fuzzy[0]) if fuzzy else None, posed, codes)
    mesh = rig.mesh(setup.binding.mesh)
    prims = _animated(stage, mesh.path, str(prim.GetPath()), str(fuzzy[0]) if fuzzy else "", where)
    there = stage.GetPrimAtPath(prims.skeleton), stage.GetPrimAtPath(prims.skel_root)
    head = find_carrier(mesh, rig.skeleton, setup, *there, to_si(metrics))
    if not prims.animation:
        findings.append(finding("ANIMATION_CREATED", prims.skeleton))
    prims = replace(prims, head=head)
    ours = [prim, *posed, *(stage.GetPrimAtPath(path) for path in fuzzy)]
    scopes = dict.fromkeys(each.GetParent() for each in posed)
    findings += unread_settings([*ours, *scopes])
    shot = Shot(take, codes, rig, setup, system, expressions, prims, metrics, parts, gains)
    return shot, findings


def _target(stage: Usd.Stage, prim: Usd.Prim, name: str, where: str) -> Usd.Prim:
    targets = prim.GetRelationship(name).GetTargets()
    if not targets:
        raise InputError(
            f"{where}, prim <{prim.GetPath()}>: {name} has no target", "SHOT_INCOMPLETE"
        )
    return _there(stage, targets[0], name, where)


def _there(stage: Usd.Stage, path: Sdf.Path, name: str, where: str) -> Usd.Prim:
    prim = stage.GetPrimAtPath(path)
    if not prim:
        raise InputError(
            f"{where}: {name} points at <{path}>, which is not on the stage; "
            "is a referenced file missing?",
            "SHOT_INCOMPLETE",
        )
    return prim


def _animated(stage: Usd.Stage, mesh: str, retarget: str, fuzzy: str, where: str) -> ShotPrims:
    """Find the skeleton and the animation that deform `mesh`."""
    prim = stage.GetPrimAtPath(mesh)
    if prim.IsInstanceProxy():
        raise InputError(
            f"{where}: mesh <{mesh}> is inside an instance, which no layer can animate; "
            "set instanceable = false on it in the shot"
        )
    skeleton = UsdSkel.BindingAPI(prim).GetInheritedSkeleton()
    if not skeleton:
        raise InputError(
            f"{where}: mesh <{mesh}> has no skel:skeleton, so USD would not play its shapes; "
            "`usdface rig` writes a rig that has one"
        )
    found = UsdSkel.Root.Find(prim)
    root = found.GetPrim() if found else None
    animation = UsdSkel.BindingAPI(skeleton.GetPrim()).GetInheritedAnimationSource()
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
