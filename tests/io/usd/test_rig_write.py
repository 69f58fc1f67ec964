from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from clips import plays
from pxr import Usd, UsdGeom, UsdShade, UsdSkel

from usdface.errors import InputError, OutputError
from usdface.io.usd.rig import read_rig
from usdface.io.usd.rig_write import write_rig
from usdface.rigs import BlendShape, MaterialSubset, Mesh, Rig, Skeleton, Skin
from usdface.takes import WeightsTake


def take(rig, rate=60.0, frames=5):
    rng = np.random.default_rng(3)
    weights = rng.uniform(-0.6, 1.4, (frames, len(rig.shape_names)))
    return WeightsTake(rig.shape_names, np.arange(frames) / rate, weights, rate)


@pytest.mark.parametrize("suffix", [".usda", ".usdc", ".usd"])
def test_usd_finds_no_error(face_rig, skinned_rig, tmp_path, assert_valid_usd, suffix):
    for number, rig in enumerate((face_rig, skinned_rig)):
        path = tmp_path / f"rig{number}{suffix}"
        write_rig(rig, path, plays(take(rig)))
        assert_valid_usd(path)


@pytest.mark.parametrize("which", ["face_rig", "skinned_rig"])
def test_usdskel_poses_what_was_written(which, request, tmp_path, posed, baked):
    rig = request.getfixturevalue(which)
    weights = take(rig)
    path = tmp_path / "rig.usdc"
    write_rig(rig, path, plays(weights))
    result = baked(path, range(5))
    for mesh, points in zip(rig.meshes, result.values(), strict=True):
        columns = weights.reordered(mesh.shape_names).weights
        expected = [posed(mesh, row) for row in columns]
        np.testing.assert_allclose(points, expected, atol=1e-7)


def test_names_are_tokens_and_stay_beside_legal_prim_names(face_rig, tmp_path):
    path = tmp_path / "rig.usda"
    findings = write_rig(face_rig, path)
    stage = Usd.Stage.Open(str(path))
    binding = UsdSkel.BindingAPI(stage.GetPrimAtPath("/Asset/Face/Head"))
    assert tuple(binding.GetBlendShapesAttr().Get()) == ("jawOpen", "Key 1", "Key.1", "口")
    names = [target.name for target in binding.GetBlendShapeTargetsRel().GetTargets()]
    assert names == ["jawOpen", "Key_1", "Key_1_1", "口"]
    assert stage.GetPrimAtPath("/Asset/Face/Teeth_1").GetDisplayName() == "Teeth.1"
    assert stage.GetDefaultPrim().GetDisplayName() == "small face"
    changed = [f.where for f in findings if f.code == "NAME_CHANGED"]
    assert "/Asset/Face/Head/Key_1_1" in changed and "/Asset/Face/Head/jawOpen" not in changed


def test_the_structure_that_viewers_need_is_authored(face_rig, tmp_path):
    path = tmp_path / "rig.usda"
    write_rig(face_rig, path)
    stage = Usd.Stage.Open(str(path))
    anim = UsdSkel.Animation(stage.GetPrimAtPath("/Asset/Face/Anim"))
    for attribute in (anim.GetTranslationsAttr(), anim.GetRotationsAttr(), anim.GetScalesAttr()):
        assert attribute.HasAuthoredValue() and len(attribute.Get()) == 1
    assert list(anim.GetBlendShapeWeightsAttr().Get()) == [0] * 4
    assert tuple(anim.GetBlendShapesAttr().Get()) == face_rig.shape_names
    for prim in stage.Traverse():
        if prim.IsA(UsdSkel.Root) or prim.IsA(UsdSkel.Skeleton):
            targets = UsdSkel.BindingAPI(prim).GetAnimationSourceRel().GetTargets()
            assert targets == [anim.GetPath()]
        if prim.IsA(UsdSkel.BlendShape):
            shape = UsdSkel.BlendShape(prim)
            count = len(shape.GetPointIndicesAttr().Get())
            assert len(shape.GetOffsetsAttr().Get()) == count
            assert len(shape.GetNormalOffsetsAttr().Get()) == count
    assert (stage.GetTimeCodesPerSecond(), stage.GetFramesPerSecond()) == (24, 24)
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1 and UsdGeom.GetStageUpAxis(stage) == "Y"


def test_time_codes_carry_seconds_at_the_rate_of_the_take(face_rig, tmp_path):
    path = tmp_path / "rig.usdc"
    times = np.array([0.5, 1.0, 1.1])
    values = np.eye(3, 4)
    write_rig(face_rig, path, plays(WeightsTake(face_rig.shape_names, times, values, 60.0)))
    stage = Usd.Stage.Open(str(path))
    weights = UsdSkel.Animation(stage.GetPrimAtPath("/Asset/Face/Anim")).GetBlendShapeWeightsAttr()
    assert weights.GetTimeSamples() == [30, 60, 66]
    assert (stage.GetTimeCodesPerSecond(), stage.GetFramesPerSecond()) == (60, 60)
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (0, 66)


def test_columns_travel_by_name(face_rig, tmp_path):
    path = tmp_path / "rig.usda"
    given = WeightsTake(("口", "nobody", "jawOpen"), [0.0], [[0.25, 9, 0.75]], 24)
    findings = write_rig(face_rig, path, plays(given))
    stage = Usd.Stage.Open(str(path))
    anim = UsdSkel.Animation(stage.GetPrimAtPath("/Asset/Face/Anim"))
    assert list(anim.GetBlendShapeWeightsAttr().Get(0)) == [0.75, 0, 0, 0.25]
    assert [f.where for f in findings if f.code == "SHAPE_UNKNOWN"] == ["nobody"]


def test_the_extent_holds_the_moving_face(face_rig, skinned_rig, tmp_path, baked):
    for rig in (face_rig, skinned_rig):
        path = tmp_path / "rig.usdc"
        write_rig(rig, path, plays(take(rig)))
        stage = Usd.Stage.Open(str(path))
        low, high = UsdSkel.Root(stage.GetPrimAtPath("/Asset/Face")).GetExtentAttr().Get()
        points = np.concatenate([p.reshape(-1, 3) for p in baked(path, range(5)).values()])
        assert (points >= np.array(low) - 1e-6).all()
        assert (points <= np.array(high) + 1e-6).all()


def test_the_extent_follows_a_rest_pose_that_is_not_the_bind_pose(skinned_rig, tmp_path):
    moved = skinned_rig.skeleton.rest.copy()
    moved[0, 3, :3] += (0.0, 5.0, 0.0)
    skeleton = Skeleton(("neck", "neck/head"), ("n", "h"), skinned_rig.skeleton.bind, moved)
    path = tmp_path / "rig.usdc"
    write_rig(Rig("moved", skinned_rig.meshes, skeleton), path)
    stage = Usd.Stage.Open(str(path))
    low, _ = UsdSkel.Root(stage.GetPrimAtPath("/Asset/Face")).GetExtentAttr().Get()
    assert low[1] > 4.8


def test_normal_offsets_are_the_change_of_the_smooth_normal(tmp_path):
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
    tilted = np.array([[0, 0, 0], [0, 0, -1], [0, 0, -1], [0, 0, 0.0]])  # 45 degrees about y
    mesh = Mesh("M", square, [4], [0, 1, 2, 3], shapes=(BlendShape("tilt", range(4), tilted),))
    path = tmp_path / "rig.usda"
    write_rig(Rig("r", (mesh,)), path)
    stage = Usd.Stage.Open(str(path))
    normals = np.array(UsdGeom.Mesh(stage.GetPrimAtPath("/Asset/Face/M")).GetNormalsAttr().Get())
    np.testing.assert_allclose(normals, [[0, 0, 1]] * 4, atol=1e-7)
    shape = UsdSkel.BlendShape(stage.GetPrimAtPath("/Asset/Face/M/tilt"))
    np.testing.assert_allclose(
        normals + np.array(shape.GetNormalOffsetsAttr().Get()),
        [[0.5**0.5, 0, 0.5**0.5]] * 4,
        atol=1e-6,
    )


def test_faces_keep_their_materials(face_rig, tmp_path):
    path = tmp_path / "rig.usda"
    write_rig(face_rig, path)
    stage = Usd.Stage.Open(str(path))
    head = UsdShade.MaterialBindingAPI(stage.GetPrimAtPath("/Asset/Face/Head"))
    bound = {
        subset.GetPrim().GetName(): len(subset.GetIndicesAttr().Get())
        for subset in head.GetMaterialBindSubsets()
    }
    assert bound == {"lips": 5, "skin": 20}


@pytest.mark.parametrize("suffix", [".usda", ".usdc"])
def test_same_rig_same_bytes(face_rig, tmp_path, suffix):
    for name in ("one", "two"):
        write_rig(face_rig, tmp_path / f"{name}{suffix}", plays(take(face_rig)))
    first, second = ((tmp_path / f"{n}{suffix}").read_bytes() for n in ("one", "two"))
    assert first == second


def test_what_cannot_be_written_is_said_and_leaves_the_old_file(face_rig, skinned_rig, tmp_path):
    with pytest.raises(OutputError, match="not a USD file name"):
        write_rig(face_rig, tmp_path / "rig.txt")
    with pytest.raises(InputError, match="no meshes"):
        write_rig(Rig("none", ()), tmp_path / "rig.usda")
    path = tmp_path / "rig.usda"
    path.write_text("old")
    mesh = skinned_rig.meshes[0]
    skin = Skin(np.full((36, 1), 2), np.ones((36, 1)))
    wrong = Mesh("M", mesh.points, mesh.face_counts, mesh.face_indices, skin=skin)
    with pytest.raises(InputError, match="2 joints"):
        write_rig(Rig("r", (wrong,), skinned_rig.skeleton), path)
    assert path.read_text() == "old"


def test_faces_in_no_subset_get_one_for_programs_that_look_only_there(
    tmp_path: Path, face_rig: Rig
) -> None:
    """Blender draws them without a material otherwise."""
    mesh = face_rig.meshes[0]
    lips = MaterialSubset(mesh.subsets[0].material, np.array([2, 3]))
    partial = replace(mesh, material=mesh.subsets[1].material, subsets=(lips,))
    write_rig(replace(face_rig, meshes=(partial,)), tmp_path / "rig.usda")
    stage = Usd.Stage.Open(str(tmp_path / "rig.usda"))
    prim = next(p for p in stage.Traverse() if p.IsA(UsdGeom.Mesh))
    subsets = UsdShade.MaterialBindingAPI(prim).GetMaterialBindSubsets()
    faces = sorted(f for subset in subsets for f in subset.GetIndicesAttr().Get())
    assert len(subsets) == 2 and faces == list(range(len(mesh.face_counts)))
    (back,) = read_rig(tmp_path / "rig.usda")[0].meshes
    assert back.material == partial.material
    assert [list(s.faces) for s in back.subsets] == [[2, 3]]
