"""How a face stands without animation is kept, beside clips and on its own."""

import json
import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom, UsdSkel

from usdface.clips import Clip, JointsTake
from usdface.io.gltf.write import write_gltf
from usdface.io.usd.rig_write import write_rig
from usdface.io.usd.stage import open_stage
from usdface.pipeline import export_scene, import_scene
from usdface.rigs import Rig
from usdface.takes import WeightsTake


def document(path: Path) -> dict:
    data = path.read_bytes()
    return json.loads(data[20 : 20 + struct.unpack_from("<I", data, 12)[0]])


def test_weights_without_animation_survive_beside_clips(tmp_path: Path, face_rig: Rig) -> None:
    rig = replace(face_rig, meshes=face_rig.meshes[1:])
    names = rig.shape_names
    moving = [
        Clip(name, WeightsTake(names, np.arange(3) / 24, np.eye(3, len(names)) * size, 24.0))
        for name, size in (("a", 1.0), ("b", 0.5))
    ]
    still = Clip("", WeightsTake(names, np.zeros(1), np.full((1, len(names)), 0.25)))
    write_gltf(rig, tmp_path / "a.glb", [*moving, still])
    assert document(tmp_path / "a.glb")["meshes"][0]["weights"] == [0.25]
    done = import_scene(tmp_path / "a.glb", tmp_path / "b.usda", every_frame=True)
    assert done.summary["clips"] == 2 and done.value.missing == ()
    done = export_scene(tmp_path / "b.usda", tmp_path / "c.glb", every_frame=True)
    assert done.summary["clips"] == 2 and done.value.missing == ()
    back = document(tmp_path / "c.glb")
    assert back["meshes"][0]["weights"] == [0.25]
    assert [animation["name"] for animation in back["animations"]] == ["a", "b"]


@pytest.mark.parametrize("weights_move", [False, True])
def test_a_pose_of_joints_without_samples_is_shown(
    tmp_path: Path, skinned_rig: Rig, baked, weights_move: bool
) -> None:
    joints = skinned_rig.skeleton.joints
    turned = np.array([[[0.6, 0, 0, 0.8], [0, 0.28, 0, 0.96]]])
    moves = skinned_rig.skeleton.rest[None, :, 3, :3]
    pose = JointsTake(joints, np.zeros(1), moves, turned, np.ones((1, 2, 3)))
    names = skinned_rig.shape_names
    curve = WeightsTake(names, np.arange(3) / 24, np.eye(3, len(names)), 24.0)
    clips = [Clip("", joints=pose)] + [Clip("talk", curve)] * weights_move
    write_rig(skinned_rig, tmp_path / "a.usda", clips)
    rest = skinned_rig.meshes[0].points
    shown = baked(tmp_path / "a.usda", [0.0])["/Asset/Face/Head"][0]
    assert np.abs(shown - rest).max() > 0.05
    for leg in (
        export_scene(tmp_path / "a.usda", tmp_path / "a.glb", every_frame=True),
        import_scene(tmp_path / "a.glb", tmp_path / "b.usda", every_frame=True),
    ):
        assert "CONVERSION_INEXACT" not in {f.code for f in leg.findings}
        assert leg.summary["clips"] == weights_move
    if not weights_move:
        again = baked(tmp_path / "b.usda", [0.0])["/Asset/Face/Head"][0]
        assert np.abs(again[:, None] - shown[None]).max(axis=2).min(axis=0).max() < 1e-6


def test_a_skeleton_at_rest_stays_there(tmp_path: Path, skinned_rig: Rig) -> None:
    from usdface.io.usd.clips import animated_rig

    write_rig(skinned_rig, tmp_path / "a.usda")
    assert animated_rig(open_stage(tmp_path / "a.usda"))[1] == ()


def one_joint(path: Path) -> Usd.Stage:
    """A square on a joint that stays at the identity, as writers add it for programs that want one.

    Its shape moves.
    """
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.SetDefaultPrim(UsdSkel.Root.Define(stage, "/Asset").GetPrim())
    skeleton = UsdSkel.Skeleton.Define(stage, "/Asset/Skel")
    skeleton.CreateJointsAttr(["head"])
    skeleton.CreateBindTransformsAttr([Gf.Matrix4d(1)])
    skeleton.CreateRestTransformsAttr([Gf.Matrix4d(1)])
    mesh = UsdGeom.Mesh.Define(stage, "/Asset/Face")
    mesh.CreatePointsAttr([(0, 0, 0), (0.1, 0, 0), (0.1, 0.1, 0), (0, 0.1, 0)])
    mesh.CreateFaceVertexCountsAttr([4])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 2, 3])
    skin = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    skin.CreateSkeletonRel().SetTargets([skeleton.GetPath()])
    skin.CreateJointIndicesPrimvar(False, 1).Set([0] * 4)
    skin.CreateJointWeightsPrimvar(False, 1).Set([1.0] * 4)
    shape = UsdSkel.BlendShape.Define(stage, "/Asset/Face/jawOpen")
    shape.CreateOffsetsAttr([(0, 0, 0.02)])
    shape.CreatePointIndicesAttr([1])
    skin.CreateBlendShapesAttr(["jawOpen"])
    skin.CreateBlendShapeTargetsRel().SetTargets([shape.GetPath()])
    clip = UsdSkel.Animation.Define(stage, "/Asset/Anim")
    clip.CreateBlendShapesAttr(["jawOpen"])
    for code in (0, 12):
        clip.CreateBlendShapeWeightsAttr().Set([code / 12], code)
    UsdSkel.BindingAPI.Apply(skeleton.GetPrim()).CreateAnimationSourceRel().SetTargets(
        [clip.GetPath()]
    )
    return stage


def exact(stage: Usd.Stage, folder: Path) -> bool:
    stage.Save()
    done = export_scene(folder / "a.usda", folder / "a.glb", every_frame=True)
    return done.summary["clips"] == 1 and done.summary["vertex_error_max_mm"] < 1e-4


@pytest.mark.parametrize("samples", [0, 1])
def test_the_pose_of_a_joint_at_the_identity_is_shown(tmp_path: Path, samples: int) -> None:
    stage = one_joint(tmp_path / "a.usda")
    clip = UsdSkel.Animation(stage.GetPrimAtPath("/Asset/Anim"))
    code = 0.0 if samples else Usd.TimeCode.Default()
    clip.CreateJointsAttr(["head"])
    clip.CreateTranslationsAttr().Set([(0, 0.5, 0)], code)
    clip.CreateRotationsAttr().Set([Gf.Quatf(0.6, 0.8, 0, 0)], code)
    clip.CreateScalesAttr().Set([Gf.Vec3h(1, 1, 1)], code)
    assert exact(stage, tmp_path)


def test_the_transform_of_a_skinned_mesh_does_not_count(tmp_path: Path) -> None:
    """Nor does that of one whose only joint moves nothing; that of its skeleton does."""
    stage = one_joint(tmp_path / "a.usda")
    assert exact(stage, tmp_path)
    turn = UsdGeom.Xformable(stage.GetPrimAtPath("/Asset/Face")).AddRotateXYZOp()
    turn.Set((0, 0, 0), 0)
    turn.Set((170, 80, 300), 24)
    assert exact(stage, tmp_path)
    move = UsdGeom.Xformable(stage.GetPrimAtPath("/Asset/Skel")).AddTranslateOp()
    move.Set((0, 0, 0), 0)
    move.Set((1, 0, 0), 24)
    assert exact(stage, tmp_path)
    assert "translation" in str(document(tmp_path / "a.glb")["animations"])


def test_a_bind_transform_that_cannot_be_inverted_is_announced(tmp_path: Path) -> None:
    stage = one_joint(tmp_path / "a.usda")
    skeleton = UsdSkel.Skeleton(stage.GetPrimAtPath("/Asset/Skel"))
    skeleton.GetBindTransformsAttr().Set([Gf.Matrix4d().SetScale(0.0)])
    stage.Save()
    found = export_scene(tmp_path / "a.usda", tmp_path / "a.glb").findings
    assert ("FEATURE_DROPPED", "/Asset/Skel") in {(f.code, f.where) for f in found}
