"""Skeletons written as glTF nodes and skins."""

from dataclasses import replace

from usdface.io.gltf.read import read_gltf
from usdface.io.gltf.write import write_gltf
from usdface.rigs import Skeleton


def test_the_joints_of_a_skin_have_a_common_root(skinned_rig, tmp_path, validate_gltf) -> None:
    old = skinned_rig.skeleton
    several = Skeleton(("neck", "head"), old.names, old.bind, old.bind)
    path = tmp_path / "a.glb"
    write_gltf(replace(skinned_rig, skeleton=several), path)
    assert validate_gltf(path)["issues"]["numErrors"] == 0
    assert read_gltf(path)[0].skeleton.joints == ("neck", "Head_Joint")
