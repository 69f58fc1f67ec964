import numpy as np
import pytest
from pxr import Gf, UsdGeom, UsdSkel
from sheets import codes, sheet

from usdface.io.usd.rig import rig_of_stage
from usdface.io.usd.rig_write import write_rig

Z_UP_CENTIMETRES = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]]) * 0.01


def skinned_sheet(joints=("neck", "neck/head"), **metrics):
    stage = sheet(**metrics)
    skel = UsdSkel.Skeleton.Define(stage, "/R/Skel")
    skel.CreateJointsAttr(joints)
    rest = [Gf.Matrix4d(1).SetTranslate((0, 1, 0)), Gf.Matrix4d(1).SetTranslate((0, 0, 2))]
    skel.CreateBindTransformsAttr([rest[0], rest[1] * rest[0]])
    skel.CreateRestTransformsAttr(rest)
    UsdGeom.XformCommonAPI(skel).SetTranslate((0, 100, 0))
    mesh = stage.GetPrimAtPath("/R/M")
    UsdGeom.XformCommonAPI(mesh).SetTranslate((7, 7, 7))
    binding = UsdSkel.BindingAPI(mesh)
    binding.CreateSkeletonRel().SetTargets([skel.GetPath()])
    binding.CreateJointIndicesPrimvar(False, 2).Set([0, 1] * 3)
    binding.CreateJointWeightsPrimvar(False, 2).Set([0.75, 0.25] * 3)
    binding.CreateGeomBindTransformAttr(Gf.Matrix4d(1).SetTranslate((3, 0, 0)))
    return stage


def test_a_skinned_mesh_stands_in_its_skeletons_space_by_its_bind_transform():
    rig, findings = rig_of_stage(skinned_sheet())
    assert findings == []
    np.testing.assert_allclose(rig.meshes[0].points[1], (4, 100, 0))
    np.testing.assert_allclose(rig.skeleton.bind[1, 3, :3], (0, 101, 2))
    np.testing.assert_allclose(rig.skeleton.rest[1, 3, :3], (0, 0, 2))
    np.testing.assert_allclose(rig.meshes[0].skin.weights, [[0.75, 0.25]] * 3)


def test_influences_that_are_a_time_sample_hold_as_well():
    stage = skinned_sheet()
    wanted = rig_of_stage(stage)[0].meshes[0].skin
    mesh = UsdGeom.PrimvarsAPI(stage.GetPrimAtPath("/R/M"))
    for primvar in mesh.GetPrimvarsWithAuthoredValues():
        value = primvar.Get()
        primvar.GetAttr().Clear()
        primvar.Set(value, 1.0)
    rig, findings = rig_of_stage(stage)
    assert findings == []
    np.testing.assert_array_equal(rig.meshes[0].skin.joints, wanted.joints)
    np.testing.assert_array_equal(rig.meshes[0].skin.weights, wanted.weights)


def test_skinning_commutes_with_units_and_up_axis(tmp_path, baked, posed):
    stage = skinned_sheet(unit=0.01, up="Z")
    stage.Export(str(tmp_path / "z.usda"))
    expected = baked(tmp_path / "z.usda", [0.0])["/R/M"] @ Z_UP_CENTIMETRES
    rig, _ = rig_of_stage(stage)
    np.testing.assert_allclose(rig.meshes[0].points, expected[0], atol=1e-6)
    assert np.allclose(np.linalg.det(rig.skeleton.bind[:, :3, :3]), 1)
    write_rig(rig, tmp_path / "y.usda")
    np.testing.assert_allclose(
        baked(tmp_path / "y.usda", [0.0])["/Asset/Face/M"], expected, atol=1e-6
    )


def test_joints_of_a_mesh_in_their_own_order_are_mapped_by_name():
    stage = skinned_sheet()
    UsdSkel.BindingAPI(stage.GetPrimAtPath("/R/M")).CreateJointsAttr(["neck/head", "neck"])
    skin = rig_of_stage(stage)[0].meshes[0].skin
    np.testing.assert_array_equal(skin.joints, [[1, 0]] * 3)


@pytest.mark.parametrize("joints", [("neck/head", "neck"), ("neck",)])
def test_a_broken_skeleton_is_left_out_with_a_finding(joints):
    rig, findings = rig_of_stage(skinned_sheet(joints))
    assert rig.skeleton is None and rig.meshes[0].skin is None
    assert "FEATURE_DROPPED" in codes(findings)


@pytest.mark.parametrize(
    ("rigid", "weights", "normals", "told"),
    [
        (True, [0.75, 0.25], True, True),
        (True, [1.0, 0.0], True, False),
        (True, [0.75, 0.25], False, False),
        (False, [0.75, 0.25], True, False),
    ],
)
def test_normals_of_a_mesh_that_several_joints_move_as_a_whole_are_told(
    rigid: bool, weights: list[float], normals: bool, told: bool
) -> None:
    """glTF has no such thing, and its players turn the normals by each joint."""
    stage = skinned_sheet()
    prim = stage.GetPrimAtPath("/R/M")
    if rigid:
        for name in ("skel:jointIndices", "skel:jointWeights"):
            prim.RemoveProperty(f"primvars:{name}")
        binding = UsdSkel.BindingAPI(prim)
        binding.CreateJointIndicesPrimvar(True, 2).Set([0, 1])
        binding.CreateJointWeightsPrimvar(True, 2).Set(weights)
    if normals:
        mesh = UsdGeom.Mesh(prim)
        mesh.CreateNormalsAttr([(0, 0, 1)] * 3)
        mesh.SetNormalsInterpolation("vertex")
    _, findings = rig_of_stage(stage)
    found = [f for f in findings if f.values.get("feature") == "rigid_skin"]
    assert [f.code for f in found] == ["FEATURE_APPROXIMATED"] * told
    if told:
        assert list(found[0].values["names"]) == ["neck", "neck/head"]
