"""Stages that validate and stand still: each fault is an error, and a sound stage has none."""

from collections.abc import Callable
from pathlib import Path

import pytest
from pxr import Sdf, Usd, UsdGeom, UsdSkel

from usdface.io.usd.check import check_stage


def sound() -> Usd.Stage:
    """A face with two shapes that an animation moves."""
    stage = Usd.Stage.CreateInMemory()
    root = UsdSkel.Root.Define(stage, "/R").GetPrim()
    mesh = UsdGeom.Mesh.Define(stage, "/R/M")
    mesh.CreatePointsAttr([(0, 0, 0), (1, 0, 0), (0, 2, 3)])
    binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    binding.CreateBlendShapesAttr(["jawOpen", "smile"])
    for name in ("jawOpen", "smile"):
        shape = UsdSkel.BlendShape.Define(stage, f"/R/M/{name}")
        shape.CreateOffsetsAttr([(0, 1, 0)])
        shape.CreatePointIndicesAttr([1])
        binding.CreateBlendShapeTargetsRel().AddTarget(shape.GetPath())
    skeleton = UsdSkel.Skeleton.Define(stage, "/R/Skel")
    animation = UsdSkel.Animation.Define(stage, "/R/Anim")
    animation.CreateBlendShapesAttr(["jawOpen", "smile"])
    animation.CreateBlendShapeWeightsAttr([0.5, 0.5])
    UsdSkel.BindingAPI.Apply(root).CreateSkeletonRel().SetTargets([skeleton.GetPath()])
    source = UsdSkel.BindingAPI.Apply(skeleton.GetPrim()).CreateAnimationSourceRel()
    source.SetTargets([animation.GetPath()])
    return stage


def anim(names: list[str]) -> Callable[[Usd.Stage], object]:
    return lambda stage: stage.GetAttributeAtPath("/R/Anim.blendShapes").Set(names)


def unapplied(path: str) -> Callable[[Usd.Stage], object]:
    return lambda stage: stage.GetPrimAtPath(path).RemoveAPI(UsdSkel.BindingAPI)


FAULTS: dict[str, tuple[Callable[[Usd.Stage], object], str, str]] = {
    "all misspelled": (anim(["JawOpen", "Smile"]), "ANIMATION_UNMATCHED", "/R/Anim"),
    "one misspelled": (anim(["jawOpen", "smiel"]), "SHAPE_UNKNOWN", "/R/Anim"),
    "no skeleton": (
        lambda stage: stage.GetPrimAtPath("/R").RemoveProperty("skel:skeleton"),
        "SKELETON_MISSING",
        "/R/M",
    ),
    "no SkelRoot": (
        lambda stage: stage.GetPrimAtPath("/R").SetTypeName("Xform"),
        "SKELROOT_MISSING",
        "/R/M",
    ),
    "mesh without schema": (unapplied("/R/M"), "SCHEMA_UNAPPLIED", "/R/M"),
    "skeleton without schema": (unapplied("/R/Skel"), "SCHEMA_UNAPPLIED", "/R/Skel"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_each_fault_is_one_finding(name: str) -> None:
    spoil, code, where = FAULTS[name]
    stage = sound()
    assert check_stage(stage) == []
    spoil(stage)
    (found,) = check_stage(stage)
    assert (found.code, found.where) == (code, where)
    assert found.severity == ("warning" if code == "SHAPE_UNKNOWN" else "error")


def test_a_fault_in_an_instance_has_the_path_that_the_stage_shows(tmp_path: Path) -> None:
    face = sound()
    anim(["JawOpen", "Smile"])(face)
    face.GetRootLayer().defaultPrim = "R"
    face.Export(str(tmp_path / "face.usda"))
    stage = Usd.Stage.CreateNew(str(tmp_path / "crowd.usda"))
    for name in ("One", "Two"):
        prim = stage.DefinePrim(f"/{name}")
        prim.GetReferences().AddReference("face.usda")
        prim.SetInstanceable(True)
    assert {(f.code, f.where) for f in check_stage(stage)} == {("ANIMATION_UNMATCHED", "/One/Anim")}


def test_usdskel_indeed_moves_nothing_then() -> None:
    """The judge: baking leaves the points where they are, or finds no binding."""
    for name, (spoil, code, _) in FAULTS.items():
        stage = sound()
        spoil(stage)
        stage.SetStartTimeCode(0)
        UsdSkel.BakeSkinning(stage.Traverse())
        points = UsdGeom.Mesh(stage.GetPrimAtPath("/R/M")).GetPointsAttr()
        moved = points.Get(0)[1][1] != 0
        assert moved == (code == "SHAPE_UNKNOWN"), name


@pytest.mark.parametrize(
    ("names", "others"), [(["smiel"], ""), (["smiel", "x", "y"], ", and 2 others")]
)
def test_the_nearest_name_is_proposed_at_the_end(names: list[str], others: str) -> None:
    stage = sound()
    anim(["jawOpen", *names])(stage)
    (found,) = [each for each in check_stage(stage) if each.code == "SHAPE_UNKNOWN"]
    assert found.message == f"'smiel' is on no mesh that it moves{others}; did you mean smile?"


def test_an_animation_may_name_shapes_of_several_meshes() -> None:
    stage = sound()
    teeth = UsdGeom.Mesh.Define(stage, "/R/Teeth")
    teeth.CreatePointsAttr([(0, 0, 0)])
    binding = UsdSkel.BindingAPI.Apply(teeth.GetPrim())
    binding.CreateBlendShapesAttr(["tongueOut"])
    shape = UsdSkel.BlendShape.Define(stage, "/R/Teeth/tongueOut")
    shape.CreateOffsetsAttr([(0, 1, 0)])
    binding.CreateBlendShapeTargetsRel().SetTargets([Sdf.Path("/R/Teeth/tongueOut")])
    anim(["tongueOut", "smile", "jawOpen"])(stage)
    stage.GetAttributeAtPath("/R/Anim.blendShapeWeights").Set([0, 0, 0])
    assert check_stage(stage) == []
