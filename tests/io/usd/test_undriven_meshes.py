"""Meshes with the face's blend shapes that the driven SkelAnimation does not move are named."""

from collections.abc import Callable
from pathlib import Path

import pytest
from processed import shoot, without_animation
from pxr import Sdf, Usd, UsdGeom, UsdSkel
from worlds import make_world

from usdface.pipeline import process

TEETH = "/Asset/Face/teeth"


def to_another_skeleton(stage: Usd.Stage) -> None:
    """Bind the teeth to a skeleton of their own, without a SkelAnimation of its own."""
    other = UsdSkel.Skeleton.Define(stage, "/Asset/Face/Other")
    binding = UsdSkel.BindingAPI.Apply(stage.GetPrimAtPath(TEETH))
    binding.CreateSkeletonRel().SetTargets([other.GetPath()])


def to_another_animation(stage: Usd.Stage) -> None:
    to_another_skeleton(stage)
    animation = UsdSkel.Animation.Define(stage, "/Asset/Face/Other/Anim")
    animation.CreateBlendShapesAttr(["jawOpen"])
    animation.CreateBlendShapeWeightsAttr([0.0])
    other = UsdSkel.BindingAPI.Apply(stage.GetPrimAtPath("/Asset/Face/Other"))
    other.CreateAnimationSourceRel().SetTargets([animation.GetPath()])


def to_another_root(stage: Usd.Stage) -> None:
    """Put the teeth below a SkelRoot of their own."""
    root = UsdSkel.Root.Define(stage, "/Asset/Mouth").GetPrim()
    layer = stage.GetRootLayer()
    assert Sdf.CopySpec(layer, TEETH, layer, "/Asset/Mouth/teeth")
    stage.RemovePrim(TEETH)
    UsdSkel.Skeleton.Define(stage, "/Asset/Mouth/Skel")
    UsdSkel.BindingAPI.Apply(root).CreateSkeletonRel().SetTargets(["/Asset/Mouth/Skel"])


def far_away(stage: Usd.Stage) -> None:
    """Another person."""
    to_another_root(stage)
    UsdGeom.Xformable(stage.GetPrimAtPath("/Asset/Mouth")).AddTranslateOp().Set((2, 0, 0))


@pytest.mark.parametrize("bare", [False, True])
@pytest.mark.parametrize(
    ("change", "undriven", "left_out"),
    [
        (lambda _: None, "", ""),
        (to_another_skeleton, "", ""),
        (to_another_animation, "/Shot/Character/Face/teeth", ""),
        (to_another_root, "/Shot/Character/Mouth/teeth", "/Shot/Character/Mouth/teeth"),
        (far_away, "", ""),
    ],
)
def test_meshes_that_do_not_play_are_named(
    tmp_path: Path, change: Callable[[Usd.Stage], None], undriven: str, left_out: str, bare: bool
) -> None:
    """`bare`: where the solve layer makes the SkelAnimation."""
    make_world(teeth=True).write(tmp_path, mesh="/Asset/Face/head")
    stage = Usd.Stage.Open(str(tmp_path / "rig.usda"))
    change(stage)
    stage.Save()
    if bare and change is not to_another_animation:
        without_animation(tmp_path)
    found = process(shoot(tmp_path), gltf=tmp_path / "face.glb").findings
    named = [each.values["meshes"] for each in found if each.code == "MESHES_UNDRIVEN"]
    assert named == ([[undriven]] if undriven else [])
    dropped = [each.values["names"] for each in found if each.values.get("feature") == "mesh"]
    assert dropped == ([[left_out]] if left_out else [])
    moving = weights_of(tmp_path / "shot.usdface.usda")
    assert {path for path, most in moving.items() if most > 0.3} == set(moving) - {undriven}


def weights_of(root: Path) -> dict[str, float]:
    """The largest weight of each mesh with blend shapes below the SkelRoot of the face."""
    stage, cache, most = Usd.Stage.Open(str(root)), UsdSkel.Cache(), {}
    top = UsdSkel.Root.Get(stage, "/Shot/Character/Face")
    cache.Populate(top, Usd.PrimDefaultPredicate)
    for binding in cache.ComputeSkelBindings(top, Usd.PrimDefaultPredicate):
        query = cache.GetSkelQuery(binding.GetSkeleton()).GetAnimQuery()
        codes = query.GetBlendShapeWeightTimeSamples() if query else []
        for target in binding.GetSkinningTargets():
            rows = [max(query.ComputeBlendShapeWeights(code)) for code in codes]
            most[str(target.GetPrim().GetPath())] = max(rows, default=0.0)
    return most
