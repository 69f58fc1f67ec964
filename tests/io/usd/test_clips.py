from pathlib import Path

import numpy as np
import pytest
from pxr import Sdf, Usd, UsdGeom, UsdSkel

from usdface.clips import Clip, JointsTake
from usdface.errors import InputError
from usdface.io.gltf.read import read_gltf
from usdface.io.usd.clips import animated_rig
from usdface.io.usd.evaluate import evaluate_usd
from usdface.io.usd.rig_write import write_rig
from usdface.pipeline import export_scene
from usdface.rigs import BlendShape, Mesh, Rig
from usdface.takes import WeightsTake


def a_face(folder: Path, name: str, shape: str, times: list[float], curve: list[float]) -> Path:
    moved = BlendShape(shape, [0], [[0, 0, 1.0]])
    mesh = Mesh(name, np.eye(3), [3], [0, 1, 2], shapes=(moved,))
    take = WeightsTake((shape,), times, np.array(curve)[:, None], 10.0)
    path = folder / f"{name}.usda"
    write_rig(Rig(name, (mesh,)), path, (Clip(name, take),))
    return path


def two_faces(folder: Path, shapes: tuple[str, str]) -> Usd.Stage:
    """Two characters, each with a SkelAnimation of its own."""
    curves = ([0.0, 1.0], [0.0, 0.5, 0.25])
    stage = Usd.Stage.CreateNew(str(folder / "both.usda"))
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.SetTimeCodesPerSecond(10.0)
    for name, shape, curve in zip("AB", shapes, curves, strict=True):
        times = [k / 10 for k in range(len(curve))]
        path = a_face(folder, name, shape, times, curve)
        stage.DefinePrim(f"/{name}").GetReferences().AddReference(f"./{path.name}")
    stage.SetDefaultPrim(stage.GetPrimAtPath("/A"))
    stage.Save()
    return stage


def test_what_plays_at_once_is_one_clip(tmp_path: Path) -> None:
    rig, (clip,), found = animated_rig(two_faces(tmp_path, ("jaw", "brow")))
    assert found == []
    assert rig.shape_names == ("jaw", "brow")
    assert clip.name == "A" and clip.weights is not None
    np.testing.assert_allclose(clip.weights.times, [0, 0.1, 0.2])
    np.testing.assert_allclose(clip.weights.column("jaw"), [0, 1, 1])
    np.testing.assert_allclose(clip.weights.column("brow"), [0, 0.5, 0.25])
    outcome = export_scene(tmp_path / "both.usda", tmp_path / "both.glb", every_frame=True)
    assert [f for f in outcome.findings if f.severity == "warning"] == []


def test_the_time_code_that_time_0_was_is_told(tmp_path: Path) -> None:
    stage = Usd.Stage.Open(str(a_face(tmp_path, "A", "jaw", [0.0, 0.1], [0.0, 1.0])))
    animation = UsdSkel.Animation(next(p for p in stage.Traverse() if p.IsA(UsdSkel.Animation)))
    weights = animation.GetBlendShapeWeightsAttr()
    weights.Clear()
    for code, value in ((1001.0, 0.0), (1002.0, 1.0)):
        weights.Set([value], code)
    stage.SetStartTimeCode(1001)
    stage.SetEndTimeCode(1002)
    _, (clip,), found = animated_rig(stage)
    assert clip.weights is not None
    np.testing.assert_allclose(clip.weights.times, [0, 0.1])
    assert [(f.code, dict(f.values)) for f in found] == [
        ("FRAMES_RENUMBERED", {"frame_number": 1001})
    ]


def test_one_name_with_two_curves_is_two_shapes(tmp_path: Path) -> None:
    rig, (clip,), found = animated_rig(two_faces(tmp_path, ("jaw", "jaw")))
    assert [(f.code, f.where) for f in found] == [("NAME_CHANGED", "/B/Face/B/jaw")]
    assert rig.shape_names == ("jaw", "Face:jaw")
    assert rig.meshes[1].shapes[0].label == "jaw"
    assert clip.weights is not None
    np.testing.assert_allclose(clip.weights.column("jaw"), [0, 1, 1])
    np.testing.assert_allclose(clip.weights.column("Face:jaw"), [0, 0.5, 0.25])
    done = export_scene(tmp_path / "both.usda", tmp_path / "both.glb", every_frame=True)
    assert [f for f in done.findings if f.severity == "warning"] == []


def test_one_face_that_stands_still_beside_one_of_its_names(tmp_path: Path) -> None:
    stage = two_faces(tmp_path, ("jaw", "jaw"))
    for prim in map(stage.GetPrimAtPath, ("/B/Face", "/B/Face/Skel")):
        prim.GetRelationship("skel:animationSource").SetTargets([])
    stage.Save()
    done = export_scene(tmp_path / "both.usda", tmp_path / "both.glb", every_frame=True)
    assert {f.code for f in done.findings if f.severity == "warning"} == {"ANIMATION_DROPPED"}
    assert done.summary["vertex_error_max_mm"] < 1e-3


def test_an_animation_that_nothing_plays_is_announced(tmp_path: Path) -> None:
    stage = Usd.Stage.Open(str(a_face(tmp_path, "A", "jaw", [0, 0.1], [0, 1])))
    spare = UsdSkel.Animation.Define(stage, "/Asset/Face/Spare")
    assert animated_rig(stage)[2] == []  # it moves nothing
    weights = spare.CreateBlendShapeWeightsAttr()
    weights.Set([0.0], 0)
    weights.Set([1.0], 5)
    found = animated_rig(stage)[2]
    assert [(f.code, f.where) for f in found] == [("ANIMATION_DROPPED", "/Asset/Face/Spare")]


def test_a_pose_is_no_clip(tmp_path: Path) -> None:
    path = a_face(tmp_path, "A", "jaw", [0], [0])
    stage = Usd.Stage.Open(str(path))
    weights = UsdSkel.Animation.Get(stage, "/Asset/Face/Anim").GetBlendShapeWeightsAttr()
    weights.Clear()
    weights.Set([0.75])
    _, (clip,), _ = animated_rig(stage)
    assert clip.still and clip.weights is not None
    assert clip.weights.weights.tolist() == [[0.75]]
    stage.Save()
    outcome = export_scene(path, tmp_path / "a.glb", every_frame=True)
    assert outcome.details["certificate"]["weight_error_max"] == 0
    assert [f.code for f in outcome.findings if f.severity == "warning"] == []


@pytest.mark.parametrize("unit", [0.01, 1.0])
@pytest.mark.parametrize("up", ["Y", "Z"])
def test_joints_move_in_any_unit_and_with_any_axis_up(tmp_path: Path, unit: float, up: str) -> None:
    from pxr import Gf

    path = a_face(tmp_path, "A", "jaw", [0, 0.1], [0, 1])
    stage = Usd.Stage.Open(str(path))
    UsdGeom.SetStageMetersPerUnit(stage, unit)
    UsdGeom.SetStageUpAxis(stage, up)
    anim = UsdSkel.Animation.Get(stage, "/Asset/Face/Anim")
    half = float(np.sqrt(0.5))
    for code, turn in enumerate([Gf.Quatf(1), Gf.Quatf(half, half, 0, 0)]):
        anim.GetTranslationsAttr().Set([(code, 0, 2)], code)
        anim.GetRotationsAttr().Set([turn], code)
        anim.GetScalesAttr().Set([(1, 2, 1)], code)
    stage.Save()
    outcome = export_scene(path, tmp_path / "a.glb", every_frame=True)
    assert [f.code for f in outcome.findings if f.severity == "warning"] == []
    certificate = outcome.details["certificate"]
    assert certificate["vertex_error_max_mm"] < 1e-5 * certificate["bounding_diagonal_mm"]
    _, (clip,), _ = animated_rig(Usd.Stage.Open(str(path)))
    assert clip.joints is not None
    moved = np.linalg.norm(np.diff(clip.joints.translations[:, 0], axis=0))
    assert moved == pytest.approx(unit, rel=1e-6)


def test_animations_of_instances_are_bound(tmp_path: Path) -> None:
    a_face(tmp_path, "A", "jaw", [0, 0.1], [0, 1])
    stage = Usd.Stage.CreateNew(str(tmp_path / "crowd.usda"))
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    for name in ("One", "Two"):
        prim = stage.DefinePrim(f"/{name}", "Xform")
        prim.GetReferences().AddReference("./A.usda")
        prim.SetInstanceable(True)
    rig, (clip,), found = animated_rig(stage)
    assert found == [] and len(rig.meshes) == 2 and len(clip.times) == 2


def test_a_blocked_sample_is_named_as_one_without_weights(tmp_path: Path) -> None:
    stage = Usd.Stage.Open(str(a_face(tmp_path, "A", "jaw", [0, 0.1], [0, 1])))
    weights = UsdSkel.Animation.Get(stage, "/Asset/Face/Anim").GetBlendShapeWeightsAttr()
    weights.Set(Sdf.ValueBlock(), 1)
    with pytest.raises(InputError, match="0 blendShapeWeights for 1 blendShapes at time code 1"):
        animated_rig(stage)


def skinned_crowd(folder: Path, skinned_rig: Rig, shared: bool) -> Usd.Stage:
    """A skinned character three times, the last one later; `shared` makes them instances."""
    times = np.arange(5) / 10
    rest = skinned_rig.skeleton.rest[:, 3, :3]
    turns = np.zeros((5, 2, 4))
    turns[..., 2], turns[..., 3] = np.sin(times)[:, None], np.cos(times)[:, None]
    moves = np.broadcast_to(rest, (5, 2, 3)) + times[:, None, None]
    joints = JointsTake(skinned_rig.skeleton.joints, times, moves, turns, np.ones((5, 2, 3)), 10.0)
    names = skinned_rig.shape_names
    weights = np.linspace(0, 1, 5 * len(names)).reshape(5, -1) ** 2
    write_rig(
        skinned_rig, folder / "one.usda", [Clip("c", WeightsTake(names, times, weights), joints)]
    )
    stage = Usd.Stage.CreateNew(str(folder / f"crowd_{shared}.usda"))
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    for k, name in enumerate(("One", "Two", "Later")):
        prim = UsdGeom.Xform.Define(stage, f"/{name}").GetPrim()
        UsdGeom.XformCommonAPI(prim).SetTranslate((k, 2 * k, 0))
        offset = Sdf.LayerOffset(4.0 if name == "Later" else 0.0)
        prim.GetReferences().AddReference("./one.usda", offset)
        prim.SetInstanceable(shared)
    stage.Save()
    return stage


def test_joints_of_instances_move_as_those_of_others(tmp_path: Path, skinned_rig: Rig) -> None:
    one, two = (skinned_crowd(tmp_path, skinned_rig, shared) for shared in (True, False))
    assert len(one.GetPrototypes()) == 2
    codes = np.arange(0, 10, 0.5)
    for instance, plain in zip(evaluate_usd(one), evaluate_usd(two), strict=True):
        np.testing.assert_array_equal(instance.points_at(codes), plain.points_at(codes))
        summed = instance.linear_morph_at(codes)
        assert summed is not None
        for frame in (0, 7):
            np.testing.assert_allclose(
                summed.points_at(frame), plain.points_at(codes)[frame], atol=1e-6
            )
    (_, (clip,), _), (_, (other,), _) = animated_rig(one), animated_rig(two)
    assert clip.joints.joints == other.joints.joints and len(clip.joints.joints) == 6
    np.testing.assert_array_equal(clip.joints.translations, other.joints.translations)
    np.testing.assert_array_equal(clip.weights.weights, other.weights.weights)
    path = tmp_path / "crowd_True.usda"
    found = export_scene(path, tmp_path / "crowd.glb", every_frame=True).findings
    assert [f.code for f in found if f.severity == "warning"] == []


def test_one_animation_of_two_characters_whose_shapes_are_renamed(tmp_path: Path) -> None:
    """Behind a third one with the same names, which moves otherwise."""
    stage = two_faces(tmp_path, ("jaw", "jaw"))
    stage.DefinePrim("/C").GetReferences().AddReference("./B.usda")
    stage.GetPrimAtPath("/C/Face/Anim").SetActive(False)
    skeleton = UsdSkel.BindingAPI(stage.GetPrimAtPath("/C/Face/Skel"))
    skeleton.CreateAnimationSourceRel().SetTargets(["/B/Face/Anim"])
    stage.Save()
    path = Path(stage.GetRootLayer().realPath)
    found = export_scene(path, tmp_path / "both.glb", every_frame=True)
    assert found.summary["weight_error_max"] == 0
    assert [f.code for f in found.findings if f.severity == "warning"] == []


def test_a_jump_between_value_clips_stays_where_it_is(tmp_path: Path) -> None:
    stage = Usd.Stage.Open(str(a_face(tmp_path, "A", "jaw", [0, 0.1], [0, 1])))
    for name, values in (("c0", (0.0, 1.0)), ("c1", (0.5, 0.25))):
        layer = Usd.Stage.CreateNew(str(tmp_path / f"{name}.usda"))
        weights = UsdSkel.Animation.Define(layer, "/Anim").CreateBlendShapeWeightsAttr()
        for code, value in enumerate(values):
            weights.Set([value], 24.0 * code)
        layer.Save()
    anim = stage.GetPrimAtPath("/Asset/Face/Anim")
    anim.GetAttribute("blendShapeWeights").Clear()
    clips = Usd.ClipsAPI(anim)
    clips.SetClipAssetPaths(["./c0.usda", "./c1.usda"])
    clips.SetClipPrimPath("/Anim")
    clips.SetClipActive([(0, 0), (24, 1)])
    clips.SetClipTimes([(0, 0), (24, 24), (24, 0), (48, 24)])
    stage.Save()
    done = export_scene(tmp_path / "A.usda", tmp_path / "a.glb", every_frame=True)
    assert "CONVERSION_INEXACT" not in {f.code for f in done.findings}
    _, (clip, *_), _ = read_gltf(tmp_path / "a.glb")
    assert clip.weights is not None
    np.testing.assert_allclose(clip.weights.weights[:, 0], [0, 1, 0.5, 0.25])
    assert clip.weights.times[2] == np.float32(2.4)  # of 10 time codes a second
