from pathlib import Path

import numpy as np
import pytest
from pxr import Usd, UsdGeom, UsdSkel

from usdface.clips import Clip
from usdface.io.gltf.read import read_gltf
from usdface.io.usd.clips import animated_rig
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
