"""The smallest rig: a SkelRoot of one triangle and one blend shape, in memory."""

from pxr import Gf, Sdf, Usd, UsdGeom, UsdSkel, Vt

__all__ = ["codes", "sheet"]


def sheet(
    offsets=((0, 1, 0),),
    indices=(1,),
    names=("up",),
    targets=("up",),
    **metrics,
):
    """A one-triangle SkelRoot in memory; every part of its blend shape can be wrong."""
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageMetersPerUnit(stage, metrics.get("unit", 1.0))
    UsdGeom.SetStageUpAxis(stage, metrics.get("up", "Y"))
    UsdSkel.Root.Define(stage, "/R")
    mesh = UsdGeom.Mesh.Define(stage, "/R/M")
    mesh.CreatePointsAttr([(0, 0, 0), (1, 0, 0), (0, 2, 3)])
    mesh.CreateFaceVertexCountsAttr([3])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 2])
    binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    binding.CreateBlendShapesAttr(names)
    binding.CreateBlendShapeTargetsRel().SetTargets([Sdf.Path(f"/R/M/{t}") for t in targets])
    shape = UsdSkel.BlendShape.Define(stage, "/R/M/up")
    shape.CreateOffsetsAttr([Gf.Vec3f(*o) for o in offsets])
    if indices is not None:
        shape.CreatePointIndicesAttr(Vt.IntArray(indices))
    return stage


def codes(findings):
    return [f.code for f in findings]
