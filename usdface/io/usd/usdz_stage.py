"""A flattened stage made complete for viewers of packages: default prim, metres per unit, Y up.

Viewers show the default prim, and some take metres and Y for granted.

Source: OpenUSD, "Usdz File Format Specification"; its ARKit checks (upAxis Y).
"""

from collections.abc import Iterable, Iterator

from pxr import Sdf, Usd, UsdGeom, UsdSkel

from usdface.findings import Finding, finding
from usdface.io.usd.held_layers import hold_layers
from usdface.schemas import tokens

__all__ = ["complete_stage"]


def complete_stage(layer: Sdf.Layer, where: str = "") -> list[Finding]:
    """Author the values that a flattened layer lacks, in place; `where` names it in findings.

    Visible prims keep their places. Markers of a take become guides, which viewers do not show.

    Returns
    -------
    list of Finding
        UNITS_ASSUMED and DEFAULT_PRIM_CHOSEN where a value had to be chosen.
    """
    stage = Usd.Stage.Open(layer)
    hold_layers(stage)
    found = []
    if not stage.GetDefaultPrim():
        chosen = _main_prim(stage)
        if chosen:
            stage.SetDefaultPrim(chosen)
            message = "the stage has no defaultPrim; viewers show {prim}"
            found.append(finding("DEFAULT_PRIM_CHOSEN", where, message, chosen.GetPath()))
    if not stage.HasAuthoredMetadata(UsdGeom.Tokens.metersPerUnit):
        unit = UsdGeom.GetStageMetersPerUnit(stage)
        UsdGeom.SetStageMetersPerUnit(stage, unit)
        message = "the stage has no metersPerUnit; {unit_m:g}, as USD assumes"
        found.append(finding("UNITS_ASSUMED", where, message, unit))
    if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z:
        for prim in _placed_in_world(stage):
            _lay_down(prim)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    for prim in stage.TraverseAll():
        if prim.GetTypeName() == tokens.MARKER_TAKE:
            UsdGeom.Imageable(prim).CreatePurposeAttr(UsdGeom.Tokens.guide)
    return found


def _main_prim(stage: Usd.Stage) -> Usd.Prim | None:
    """Return the prim at the root that has the first character below it, else the first."""
    roots = [prim for prim in stage.Traverse() if prim.IsA(UsdSkel.Root)]
    if roots:
        return stage.GetPrimAtPath(roots[0].GetPath().GetPrefixes()[0])
    return next(iter(stage.GetPseudoRoot().GetChildren()), None)


def _placed_in_world(stage: Usd.Stage) -> Iterable[Usd.Prim]:
    """Return the uppermost prims that have a place, and those that do not take that of others."""
    tops = (top for prim in stage.GetPseudoRoot().GetChildren() for top in _uppermost(prim))
    resetting = (
        prim
        for prim in stage.TraverseAll()
        if prim.IsA(UsdGeom.Xformable) and UsdGeom.Xformable(prim).GetResetXformStack()
    )
    return dict.fromkeys([*tops, *resetting])


def _uppermost(prim: Usd.Prim) -> Iterator[Usd.Prim]:
    if prim.IsA(UsdGeom.Xformable):
        yield prim
        return
    for child in prim.GetChildren():
        yield from _uppermost(child)


def _lay_down(prim: Usd.Prim) -> None:
    """Turn a prim from Z up to Y up."""
    xform = UsdGeom.Xformable(prim)
    resets, ops = xform.GetResetXformStack(), xform.GetOrderedXformOps()
    turn = xform.AddRotateXOp(opSuffix="upAxis")
    turn.Set(-90.0)
    xform.SetXformOpOrder([turn, *ops], resets)
