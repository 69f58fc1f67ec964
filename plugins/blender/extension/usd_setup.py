"""The setup of a shot on a USD stage: authored from the panel, or kept from an import."""

from pathlib import Path

from pxr import Gf, Sdf, Usd, UsdGeom, UsdSkel

_RETARGET, _EXPRESSION = "UsdFaceRetarget", "UsdFaceExpression"
_GAIN, _MESH, _RIG = "usdface:gain", "usdface:bind:mesh", "usdface:rig"
_TAKE, _FUZZY, _EXPRESSIONS = "usdface:take", "usdface:fuzzySystem", "usdface:expressions"
_TOLERANCE = "usdface:contact:tolerance"  # stage units
_RESIDUAL = "usdface:residual"
_RESULTS = ".usdface"  # how folders of result layers end
_OBJECT = "userProperties:blender:object_name"
KEPT = Sdf.Path("/UsdFace")  # where a kept text has its prims


def author_gains(stage: Usd.Stage, gains: dict[str, float]) -> None:
    """Author gains of emotions on the expressions of a stage."""
    for prim in stage.Traverse():
        if prim.GetTypeName() == _EXPRESSION and prim.GetName() in gains:
            gain = prim.CreateAttribute(_GAIN, Sdf.ValueTypeNames.Float, custom=False)
            gain.Set(gains[prim.GetName()])


def mesh_prim(stage: Usd.Stage, name: str, usd_name: str) -> Usd.Prim | None:
    """Return the exported mesh of an object, by the object's name, else by the prim's."""
    meshes = [
        prim
        for prim in stage.Traverse()
        if prim.IsA(UsdGeom.Mesh)
        and UsdSkel.BindingAPI(prim).GetBlendShapesAttr().HasAuthoredValue()
    ]
    for mesh in meshes:
        for prim in (mesh, mesh.GetParent()):
            attribute = prim.GetAttribute(_OBJECT)
            if attribute and attribute.Get() == name:
                return mesh
    return next((m for m in meshes if usd_name in (m.GetName(), m.GetParent().GetName())), None)


def skel_root(prim: Usd.Prim) -> str:
    """Return the path of the SkelRoot above a prim; "" if there is none."""
    root = UsdSkel.Root.Find(prim)
    return str(root.GetPath()) if root else ""


def setups_of(stage: Usd.Stage) -> list[Usd.Prim]:
    """Return the setups of a stage."""
    return [prim for prim in stage.Traverse() if prim.GetTypeName() == _RETARGET]


def is_processed(retarget: Usd.Prim) -> bool:
    """Whether a result lies over a setup."""
    return retarget.GetAttribute(_RESIDUAL).GetNumTimeSamples() > 0


def own_prims(stage: Usd.Stage) -> list[Sdf.Path]:
    """Return the prims of usdface on a stage."""
    return [p.GetPath() for p in stage.Traverse() if p.GetTypeName().startswith("UsdFace")]


def bound_mesh_path(retarget: Usd.Prim) -> Sdf.Path | None:
    """Return the path of the mesh that a setup is bound to."""
    targets = retarget.GetRelationship(_MESH).GetForwardedTargets()
    return targets[0] if targets else None


def setup_text(path: Path) -> str:
    """Return the setup and the take of a shot as the text of a layer, without results.

    The shot has one setup at least; the first is returned.
    """
    stage = Usd.Stage.Open(str(path))
    results = [
        layer.identifier
        for layer in stage.GetUsedLayers()
        if layer.realPath and Path(layer.realPath).parent.name.endswith(_RESULTS)
    ]
    stage.MuteAndUnmuteLayers(results, [])
    (retarget, *_) = setups_of(stage)
    flat = stage.Flatten()
    kept = Usd.Stage.CreateInMemory()
    layer = kept.GetRootLayer()
    for key in ("metersPerUnit", "upAxis", "timeCodesPerSecond", "framesPerSecond"):
        kept.SetMetadata(key, stage.GetMetadata(key))
    scope = UsdGeom.Scope.Define(kept, KEPT).GetPath()
    capture = UsdGeom.Xform.Define(kept, scope.AppendChild("Capture"))
    moves = {}
    for relationship, place in (
        (_TAKE, capture.GetPath().AppendChild("Take")),
        (_FUZZY, scope.AppendChild("Fuzzy")),
        (_EXPRESSIONS, None),
    ):
        for target in retarget.GetRelationship(relationship).GetForwardedTargets():
            moves[target] = place or scope.AppendPath(f"Expressions/{target.name}")
            if relationship == _EXPRESSIONS:
                UsdGeom.Scope.Define(kept, scope.AppendChild("Expressions"))
    moves[retarget.GetPath()] = scope.AppendChild("Retarget")
    for source, place in moves.items():
        Sdf.CopySpec(flat, source, layer, place)
    new = kept.GetPrimAtPath(moves[retarget.GetPath()])
    for relationship in (_TAKE, _FUZZY, _EXPRESSIONS):
        targets = retarget.GetRelationship(relationship).GetForwardedTargets()
        if targets:
            new.GetRelationship(relationship).SetTargets([moves[t] for t in targets])
    takes = retarget.GetRelationship(_TAKE).GetForwardedTargets()
    if takes:
        above = stage.GetPrimAtPath(takes[0]).GetParent()
        capture.AddTransformOp().Set(UsdGeom.XformCache().GetLocalToWorldTransform(above))
    return layer.ExportToString()


def restore(stage: Usd.Stage, text: str, mesh: Usd.Prim, scope: Sdf.Path) -> None:
    """Author a kept setup on a stage, for a mesh of it, in its units and on its clock."""
    from usdface.schemas import write_fallback_types

    source = Sdf.Layer.CreateAnonymous(".usda")
    source.ImportFromString(text)
    kept = Usd.Stage.Open(source)
    layer = stage.GetRootLayer()
    ratio = stage.GetTimeCodesPerSecond() / kept.GetTimeCodesPerSecond()
    if ratio != 1.0:
        _scale_codes(source, ratio)
    Sdf.CreatePrimInLayer(layer, scope)
    Sdf.CopySpec(source, KEPT, layer, scope)
    _retarget_paths(stage, scope)
    retarget = stage.GetPrimAtPath(scope.AppendChild("Retarget"))
    retarget.CreateRelationship(_MESH, custom=False).SetTargets([mesh.GetPath()])
    retarget.CreateRelationship(_RIG, custom=False).SetTargets([Sdf.Path(skel_root(mesh))])
    unit = UsdGeom.GetStageMetersPerUnit(kept) / UsdGeom.GetStageMetersPerUnit(stage)
    tolerance = retarget.GetAttribute(_TOLERANCE)
    if tolerance and tolerance.HasAuthoredValue():
        tolerance.Set(tolerance.Get() * unit)
    capture = UsdGeom.Xformable(stage.GetPrimAtPath(scope.AppendChild("Capture")))
    for operation in capture.GetOrderedXformOps():
        operation.Set(operation.Get() * _change(kept, stage, unit))
    write_fallback_types(layer)


def _retarget_paths(stage: Usd.Stage, scope: Sdf.Path) -> None:
    """Let relationships below a scope name what was copied there."""
    for prim in Usd.PrimRange(stage.GetPrimAtPath(scope)):
        for relationship in prim.GetRelationships():
            targets = relationship.GetTargets()
            relationship.SetTargets([t.ReplacePrefix(KEPT, scope) for t in targets])


def _change(kept: Usd.Stage, stage: Usd.Stage, unit: float) -> Gf.Matrix4d:
    """Return the matrix from one stage's space to another's, for row vectors."""
    matrix = Gf.Matrix4d(1.0).SetScale(unit)
    one, other = (UsdGeom.GetStageUpAxis(s) for s in (kept, stage))
    if one != other:
        up = 90.0 if one == UsdGeom.Tokens.y else -90.0
        matrix *= Gf.Matrix4d().SetRotate(Gf.Rotation(Gf.Vec3d.XAxis(), up))
    return matrix


def _scale_codes(layer: Sdf.Layer, ratio: float) -> None:
    paths: list[Sdf.Path] = []
    layer.Traverse(layer.pseudoRoot.path, paths.append)
    for path in paths:
        if path.IsPropertyPath():
            samples = [
                (c, layer.QueryTimeSample(path, c)) for c in layer.ListTimeSamplesForPath(path)
            ]
            for code, _ in samples:
                layer.EraseTimeSample(path, code)
            for code, value in samples:
                layer.SetTimeSample(path, code * ratio, value)
