from pathlib import Path

import pytest
from pxr import Usd, UsdSkel

from usdface.io.usd.instances import shown_path

ALL = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)


def crowd(folder: Path) -> Usd.Stage:
    """Two instances of a group in which a character is an instance as well."""
    face = Usd.Stage.CreateNew(str(folder / "face.usda"))
    UsdSkel.Animation.Define(face, "/Face/Anim")
    UsdSkel.Skeleton.Define(face, "/Face/Skel")
    face.SetDefaultPrim(face.GetPrimAtPath("/Face"))
    face.Save()
    group = Usd.Stage.CreateNew(str(folder / "group.usda"))
    group.DefinePrim("/Group/Hero").GetReferences().AddReference("face.usda")
    group.GetPrimAtPath("/Group/Hero").SetInstanceable(True)
    group.SetDefaultPrim(group.GetPrimAtPath("/Group"))
    group.Save()
    stage = Usd.Stage.CreateNew(str(folder / "crowd.usda"))
    for name in ("One", "Two"):
        prim = stage.DefinePrim(f"/World/{name}")
        prim.GetReferences().AddReference("group.usda")
        prim.SetInstanceable(True)
    UsdSkel.Animation.Define(stage, "/World/Anim")
    return stage


@pytest.mark.parametrize("name", ["One", "Two"])
def test_a_shared_prim_has_the_path_of_the_instance_that_is_meant(
    tmp_path: Path, name: str
) -> None:
    stage = crowd(tmp_path)
    beside = stage.GetPrimAtPath(f"/World/{name}/Hero/Skel")
    shared = stage.GetPrimAtPath("/World/One/Hero/Anim").GetPrimInPrototype()
    assert shared.IsInPrototype()
    assert shown_path(shared, beside) == f"/World/{name}/Hero/Anim"


def test_other_prims_keep_their_paths(tmp_path: Path) -> None:
    stage = crowd(tmp_path)
    beside = stage.GetPrimAtPath("/World/One/Hero/Skel")
    own = stage.GetPrimAtPath("/World/Anim")
    assert shown_path(own, beside) == own.GetPath()
    proxy = stage.GetPrimAtPath("/World/Two/Hero/Anim")
    assert shown_path(proxy, beside) == proxy.GetPath()
    assert shown_path(beside.GetPrimInPrototype(), own) == beside.GetPrimInPrototype().GetPath()
