import numpy as np
import pytest
from pxr import Gf, Sdf, UsdGeom, UsdShade, UsdSkel
from sheets import codes, sheet

from usdface.errors import InputError
from usdface.geometry.vertex_normals import unit_or_zero
from usdface.io.usd.rig import rig_of_stage


def test_units_and_up_axis_turn_and_scale_but_do_not_move_offsets():
    rig, _ = rig_of_stage(sheet(unit=0.01, up="Z"))
    np.testing.assert_allclose(rig.meshes[0].points[2], (0, 0.03, -0.02))
    np.testing.assert_allclose(rig.meshes[0].shapes[0].offsets, [(0, 0, -0.01)])


def test_a_mesh_without_skin_stands_by_its_own_transform():
    stage = sheet()
    UsdGeom.XformCommonAPI(stage.GetPrimAtPath("/R/M")).SetTranslate((5, 0, 0))
    UsdGeom.XformCommonAPI(stage.GetPrimAtPath("/R/M")).SetScale((2, 2, 2))
    mesh = rig_of_stage(stage)[0].meshes[0]
    np.testing.assert_allclose(mesh.points[1], (7, 0, 0))
    np.testing.assert_allclose(mesh.shapes[0].offsets, [(0, 2, 0)])


def test_left_handed_faces_are_turned_and_keep_their_uvs():
    stage = sheet()
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/R/M"))
    uv = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar(
        "map1", Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.faceVarying
    )
    uv.Set([(0, 0), (1, 0), (0, 1)])
    mesh.CreateOrientationAttr(UsdGeom.Tokens.leftHanded)
    turned = rig_of_stage(stage)[0].meshes[0]
    assert list(turned.face_indices) == [0, 2, 1]
    np.testing.assert_array_equal(turned.uvs, [(0, 0), (0, 1), (1, 0)])
    UsdGeom.XformCommonAPI(mesh).SetScale((-1, 1, 1))  # mirrored again: as it was
    assert list(rig_of_stage(stage)[0].meshes[0].face_indices) == [0, 1, 2]


@pytest.mark.parametrize(
    ("purposes", "shown"),
    [
        ({"": "a"}, "a"),
        ({"preview": "a"}, "a"),
        ({"full": "a"}, "a"),
        ({"": "b", "preview": "a", "full": "c"}, "a"),
        ({"": "a", "full": "b"}, "a"),
    ],
)
def test_the_material_is_the_one_that_viewers_show(purposes, shown):
    stage = sheet()
    binding = UsdShade.MaterialBindingAPI.Apply(stage.GetPrimAtPath("/R/M"))
    for purpose, name in purposes.items():
        material = UsdShade.Material.Define(stage, f"/R/{name}")
        binding.Bind(material, materialPurpose=purpose)
    assert rig_of_stage(stage)[0].meshes[0].material == shown


def test_holes_are_announced():
    stage = sheet()
    before = codes(rig_of_stage(stage)[1])
    UsdGeom.Mesh(stage.GetPrimAtPath("/R/M")).CreateHoleIndicesAttr([0])
    assert codes(rig_of_stage(stage)[1]) == [*before, "FEATURE_DROPPED"]


def test_corner_normals_become_point_normals():
    stage = sheet()
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/R/M"))
    mesh.CreateNormalsAttr([(0, 0, 1), (0, 2, 0), (1, 0, 0)])
    mesh.SetNormalsInterpolation(UsdGeom.Tokens.faceVarying)
    rig, findings = rig_of_stage(stage)
    np.testing.assert_allclose(rig.meshes[0].normals, [(0, 0, 1), (0, 1, 0), (1, 0, 0)])
    assert codes(findings) == []
    mesh.CreateNormalsAttr([(0, 0, 1), (0, 2, 0)])
    assert codes(rig_of_stage(stage)[1]) == ["FEATURE_DROPPED"]


def test_what_changes_over_time_and_is_read_once_is_announced():
    stage = sheet()
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/R/M"))
    bind = UsdSkel.BindingAPI(mesh).CreateGeomBindTransformAttr()
    for code, corners in ((0, [3]), (1, [3])):  # the same
        mesh.GetFaceVertexCountsAttr().Set(corners, code)
        bind.Set(Gf.Matrix4d(1), code)
    before = codes(rig_of_stage(stage)[1])
    assert "ANIMATION_DROPPED" not in before
    bind.Set(Gf.Matrix4d(2), 1)
    mesh.CreateNormalsAttr().Set([(0, 0, 1)] * 3, 0)
    mesh.GetNormalsAttr().Set([(0, 1, 0)] * 3, 1)
    (found,) = [f for f in rig_of_stage(stage)[1] if f.code == "ANIMATION_DROPPED"]
    assert found.where == "/R/M"
    assert found.values == {"channels": ["normals", "skel:geomBindTransform"]}


@pytest.mark.parametrize("scale", [(1, 1, 1), (3, 3, 3), (4, 1, 0.5), (2, 1, -1)])
def test_shapes_turn_normals_of_any_length_as_usdskel_does(scale):
    """UsdSkel adds offsets to the authored normals; only their sum gets unit length."""
    normals = np.array([(0, 0, 1), (0, 0.125, 0.5), (1, 2, 3)])
    offsets = np.array([(0.5, 0, 0), (0.25, 0.5, 0), (-1, 2, 0)])
    stage = sheet(offsets=np.zeros((3, 3)).tolist(), indices=(0, 1, 2))
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/R/M"))
    UsdGeom.XformCommonAPI(mesh).SetScale(scale)
    UsdGeom.XformCommonAPI(mesh).SetRotate((10, 20, 30))
    mesh.CreateNormalsAttr(normals)
    mesh.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
    UsdSkel.BlendShape(stage.GetPrimAtPath("/R/M/up")).CreateNormalOffsetsAttr(offsets)
    (read,) = rig_of_stage(stage)[0].meshes
    world = np.array(UsdGeom.Xformable(mesh).ComputeLocalToWorldTransform(0))[:3, :3]
    for weight in (0, 1, 0.3):
        expected = unit_or_zero((normals + weight * offsets) @ np.linalg.inv(world).T)
        posed = unit_or_zero(read.normals + weight * read.shapes[0].normal_offsets)
        np.testing.assert_allclose(posed, expected, atol=1e-6)


@pytest.mark.parametrize("indices", [[0, 1], [0, 1, 3], [0, -1, 2]])
def test_faces_that_do_not_fit_are_an_input_error(indices):
    stage = sheet()
    UsdGeom.Mesh(stage.GetPrimAtPath("/R/M")).GetFaceVertexIndicesAttr().Set(indices)
    with pytest.raises(InputError, match="/R/M"):
        rig_of_stage(stage)


def test_the_colour_of_a_group_is_that_of_its_meshes():
    stage = sheet()
    group = UsdGeom.PrimvarsAPI(stage.GetPrimAtPath("/R"))
    colour = group.CreatePrimvar(
        "displayColor", Sdf.ValueTypeNames.Color3fArray, UsdGeom.Tokens.constant
    )
    colour.Set([(1, 0.5, 0)])
    values = rig_of_stage(stage)[0].meshes[0].corners("displayColor")
    np.testing.assert_array_equal(values, [(1, 0.5, 0)] * 3)


@pytest.mark.parametrize("kind", ["texCoord2h[]", "texCoord2d[]", "texCoord3f[]"])
def test_texture_coordinates_of_other_precision_are_read_and_others_announced(kind):
    stage = sheet()
    types = Sdf.ValueTypeNames
    given = UsdGeom.PrimvarsAPI(stage.GetPrimAtPath("/R/M")).CreatePrimvar(
        "st", types.Find(kind), UsdGeom.Tokens.vertex
    )
    width = 3 if kind == "texCoord3f[]" else 2
    given.Set([row[:width] for row in ((0, 0, 0), (1, 0, 0), (0.5, 1, 0))])
    rig, found = rig_of_stage(stage)
    ignored = [f.values["channels"] for f in found if f.code == "CHANNEL_IGNORED"]
    if width == 3:
        assert rig.meshes[0].uvs is None and ignored == [["st"]]
    else:
        np.testing.assert_array_equal(rig.meshes[0].uvs, [(0, 0), (1, 0), (0.5, 1)])
        assert ignored == []
