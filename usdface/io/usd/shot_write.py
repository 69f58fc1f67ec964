"""Writing a shot: as a file that references rig and take, or on an open stage."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdSkel

from usdface.errors import InputError, OutputError
from usdface.findings import Finding
from usdface.io.usd.animation_write import editable_layer
from usdface.io.usd.expressions import write_expressions
from usdface.io.usd.face_layout import write_layout
from usdface.io.usd.fingerprint import sign
from usdface.io.usd.fuzzy import write_fuzzy
from usdface.io.usd.held_layers import hold_specs
from usdface.io.usd.metrics import Metrics, metrics_of, new_stage, to_si
from usdface.io.usd.retarget_setup import write_setup
from usdface.io.usd.save_layers import relative_asset, save_layers
from usdface.io.usd.shared_layers import SharedLayers, share
from usdface.io.usd.stage import default_prim, open_stage
from usdface.io.usd.take_write import define_take
from usdface.io.usd.value_arrays import matrices
from usdface.schemas import tokens, write_fallback_types
from usdface.shot.shot import Shot

__all__ = ["author_shot", "write_shot"]

_CHARACTER = "/Shot/Character"
_CAPTURE = "/Shot/Capture"
_TAKE = "/Shot/Capture/Take"


def write_shot(
    path: Path,
    rig: Path,
    take: Path,
    shot: Shot,
    shared: SharedLayers | None,
    *,
    rules: str,
) -> tuple[list[Path], list[Finding]]:
    """Write a shot that references the files `rig` and `take` and holds the setup of `shot`.

    Units and up axis are the rig's, the clock is the take's. The bound mesh of the setup is a
    prim path on the rig's own stage. Contents of `shared` layers go there, unless these exist
    already. `rules` names the file that its rule base is from; "" = designed for the rig.

    Returns
    -------
    list of Path
        The written files, the shot first.
    list of Finding
        LAYER_KEPT, LAYER_RULES_DIFFER.

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
    mesh = shot.setup.binding.mesh
    if mesh:
        targets[tokens.BIND_MESH] = [_referenced(mesh, character, rig)]
        root = _skel_root(rig_stage.GetPrimAtPath(mesh))
        targets |= {tokens.RIG: [_referenced(root, character, rig)]} if root else {}
    _define_setup(stage, "/Shot", shot, targets)
    # On a layer that no stage composes, because the paths are relative to where it will lie.
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.TransferContent(stage.GetRootLayer())
    hold_specs(stage.GetRootLayer())
    for place, asset, root in (
        (_CHARACTER, rig, character),
        (_TAKE, take, str(default_prim(take_stage, take).GetPath())),
    ):
        prim = Sdf.CreatePrimInLayer(layer, place)
        prim.specifier = Sdf.SpecifierDef
        prim.referenceList.prependedItems = [Sdf.Reference(relative_asset(asset, path), root)]
    for place in _instances(rig_stage, mesh) if mesh else ():
        # No layer can animate prims that instances share.
        Sdf.CreatePrimInLayer(layer, _referenced(place, character, rig)).instanceable = False
    write_fallback_types(layer)
    new, findings = share(layer, path, shared or SharedLayers(), rules)
    sign(layer)
    save_layers([*new, (path, layer)])
    return [path, *(place for place, _ in new)], findings


def author_shot(stage: Usd.Stage, scope: str, shot: Shot, take: str, start_code: float) -> None:
    """Author the setup of a shot on the edit target of the stage that its rig is on.

    Parameters
    ----------
    stage : Usd.Stage
    scope : str
        Path of the prim of the setup; a setup at that path is replaced.
    shot : Shot
        `setup.binding.mesh` is a prim path on the stage.
    take : str
        Path of the take's prim; without one the take is authored below `scope`.
    start_code : float
        Time code of the first frame of a take that is authored.

    Raises
    ------
    OutputError
        If the edit target cannot be edited, has a clock of its own, or is none of the stage's
        own layers.
    """
    layer = editable_layer(stage)
    target = stage.GetEditTarget()
    offset = stage.GetEditTargetForLocalLayer(layer).GetMapFunction().timeOffset
    if not offset.IsIdentity():
        raise OutputError(
            f"the edit target {layer.identifier} has a clock of its own (offset {offset.offset:g}, "
            f"scale {offset.scale:g}); choose a layer with the stage's clock"
        )
    metrics = metrics_of(stage)
    beside = new_stage(metrics)  # so that the stage changes once, and whole
    if not take:
        take = f"{scope}/Take"
        define_take(beside, take, shot.take, metrics, start_code)
    mesh = shot.setup.binding.mesh
    targets = {tokens.TAKE: [take]}
    if mesh:
        root = _skel_root(stage.GetPrimAtPath(mesh))
        targets |= {tokens.BIND_MESH: [mesh]} | ({tokens.RIG: [root]} if root else {})
    _define_setup(beside, scope, shot, targets)
    beside.GetPrimAtPath(scope).SetTypeName("Scope")
    place = Sdf.Path(scope)
    there = {prim.GetPath() for prim in stage.Traverse()}
    new = [path for path in place.GetPrefixes()[:-1] if path not in there]
    with Sdf.ChangeBlock():
        Sdf.CreatePrimInLayer(layer, target.MapToSpecPath(place))
        for parent in new:  # else it would be an over over nothing, which nobody traverses
            spec = layer.GetPrimAtPath(target.MapToSpecPath(parent))
            spec.specifier, spec.typeName = Sdf.SpecifierDef, "Scope"
        Sdf.CopySpec(beside.GetRootLayer(), place, layer, target.MapToSpecPath(place))
    hold_specs(beside.GetRootLayer())


def _define_setup(stage: Usd.Stage, scope: str, shot: Shot, targets: dict[str, list[str]]) -> None:
    """Define the prims of a setup below `scope`; `targets` are relationships of the setup."""
    if shot.system is not None:
        write_fuzzy(stage, f"{scope}/Fuzzy", shot.system)
        targets[tokens.SYSTEM] = [f"{scope}/Fuzzy"]
    if shot.expressions:
        posed = write_expressions(stage, f"{scope}/Expressions", shot.expressions)
        targets[tokens.EXPRESSIONS] = posed
    write_setup(stage, f"{scope}/Retarget", shot.setup, targets)
    if shot.system is not None:
        unit = metrics_of(stage).meters_per_unit
        write_layout(stage.GetPrimAtPath(f"{scope}/Retarget"), shot.layout, unit)


def _stage_of(rig: Metrics, take: Metrics) -> Usd.Stage:
    """Make a stage in the rig's space on the take's clock, with a place for the take."""
    stage = new_stage(
        replace(take, meters_per_unit=rig.meters_per_unit, up_axis=rig.up_axis), "Shot"
    )
    # The units of the take are corrected on a parent, which every reader of USD understands.
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


def _instances(stage: Usd.Stage, mesh: str) -> list[str]:
    """Return the paths of the prims, of a mesh or above it, that are instances."""
    above = (stage.GetPrimAtPath(place) for place in Sdf.Path(mesh).GetPrefixes())
    return [str(prim.GetPath()) for prim in above if prim.IsInstanceable()]


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
