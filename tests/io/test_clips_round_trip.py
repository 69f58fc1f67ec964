"""Clips, with joints and weights, go from USD to glTF and back, and the other way round."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom

from usdface.cli import main
from usdface.clips import Clip, JointsTake
from usdface.io.compare_conversion import certify_conversion
from usdface.io.gltf.read import read_gltf
from usdface.io.gltf.write import write_gltf
from usdface.io.transforms import compose
from usdface.io.usd.clips import animated_rig
from usdface.io.usd.rig_write import write_rig
from usdface.io.usd.stage import open_stage
from usdface.options import ExportOptions
from usdface.pipeline import export_scene, import_scene
from usdface.rigs import BlendShape, Mesh, Rig, Skeleton, Skin
from usdface.takes import WeightsTake

CLIPS = ("Sprechen ü", "笑 う", "Key.1", "Key 1", "a/b", "1x", "Anim", "Animations")
JOINTS = ("Wurzel", "Wurzel/Hals", "Wurzel/Hals/Kopf", "Wurzel/Auge")


def turns(rng: np.random.Generator, *shape: int) -> np.ndarray:
    values = rng.normal(size=(*shape, 4))
    return values / np.linalg.norm(values, axis=-1, keepdims=True)


def a_character(seed: int) -> tuple[Rig, tuple[Clip, ...]]:
    rng = np.random.default_rng(seed)
    count, width = 30, int(rng.integers(1, 7))
    points = rng.normal(size=(count, 3))
    faces = rng.permutation(count)
    shapes = tuple(
        BlendShape.from_dense(name, rng.normal(0, 0.1, (count, 3))) for name in ("jaw ü", "口")
    )
    held = rng.random((count, width)) + 0.1
    skin = Skin(rng.integers(0, 4, (count, width)), held / held.sum(axis=1, keepdims=True))
    head = Mesh("Head", points, np.full(10, 3), faces, shapes=shapes, skin=skin)
    still = Mesh("Still", points + 5, np.full(10, 3), faces)
    joints = len(JOINTS)
    rest = compose(rng.normal(size=(joints, 3)), turns(rng, joints), np.ones((joints, 3)))
    bind = compose(rng.normal(size=(joints, 3)), turns(rng, joints), np.ones((joints, 3)))
    names = tuple(joint.rpartition("/")[2] for joint in JOINTS)
    rig = Rig("Figur", (head, still), Skeleton(JOINTS, names, bind, rest))
    clips = []
    for name in rng.permutation(CLIPS)[: rng.integers(1, 5)].tolist():
        start, frames = rng.integers(0, 10), int(rng.integers(2, 20))
        times = (start + np.arange(frames)) / 24
        weights = WeightsTake(rig.shape_names, times, rng.normal(size=(frames, 2)), 24.0)
        moved = tuple(sorted(rng.permutation(JOINTS)[: rng.integers(1, 5)].tolist()))
        size = (frames, len(moved))
        scales = rng.integers(1, 9, (*size, 3)) / 4  # which 16 bits hold
        take = JointsTake(moved, times, rng.normal(size=(*size, 3)), turns(rng, *size), scales, 24)
        clips.append(Clip(name, weights, take))
    return rig, tuple(clips)


def assert_same(clips: tuple[Clip, ...], others: tuple[Clip, ...]) -> None:
    assert [clip.name for clip in others] == [clip.name for clip in clips]
    for one, other in zip(clips, others, strict=True):
        assert one.weights is not None and other.weights is not None
        np.testing.assert_allclose(other.weights.times, one.weights.times, atol=1e-6)
        same = other.weights.reordered(one.weights.names)
        np.testing.assert_allclose(same.weights, one.weights.weights, atol=1e-6)
        assert one.joints is not None and other.joints is not None
        np.testing.assert_allclose(other.joints.times, one.joints.times, atol=1e-6)
        assert {*one.joints.joints} <= {*other.joints.joints}
        own = [other.joints.joints.index(joint) for joint in one.joints.joints]
        matrices = [
            compose(take.translations, take.rotations, take.scales)
            for take in (one.joints, other.joints)
        ]
        np.testing.assert_allclose(matrices[1][:, own], matrices[0], atol=2e-6)


@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(k, marks=pytest.mark.slow) for k in (2, 3))])
def test_usd_to_gltf_to_usd(tmp_path: Path, seed: int, validate_gltf) -> None:
    rig, clips = a_character(seed)
    write_rig(rig, tmp_path / "a.usdc", clips)
    there = export_scene(tmp_path / "a.usdc", tmp_path / "b.glb", every_frame=True)
    back = import_scene(tmp_path / "b.glb", tmp_path / "c.usdc", every_frame=True)
    assert [f for f in there.findings + back.findings if f.severity != "info"] == []
    assert validate_gltf(tmp_path / "b.glb")["issues"]["numErrors"] == 0
    assert_same(clips, animated_rig(open_stage(tmp_path / "a.usdc"))[1])
    assert_same(clips, animated_rig(open_stage(tmp_path / "c.usdc"))[1])


@pytest.mark.parametrize("seed", [4, 6, *(pytest.param(k, marks=pytest.mark.slow) for k in (5, 7))])
def test_gltf_to_usd_to_gltf(tmp_path: Path, seed: int) -> None:
    rig, clips = a_character(seed)
    write_gltf(rig, tmp_path / "a.glb", clips)
    there = import_scene(tmp_path / "a.glb", tmp_path / "b.usda", every_frame=True)
    back = export_scene(tmp_path / "b.usda", tmp_path / "c.glb", every_frame=True)
    assert [f for f in there.findings + back.findings if f.severity != "info"] == []
    assert_same(clips, read_gltf(tmp_path / "a.glb")[1])
    assert_same(clips, read_gltf(tmp_path / "c.glb")[1])


def test_the_report_has_each_clip(tmp_path: Path) -> None:
    rig, clips = a_character(2)
    assert len(clips) > 1
    write_rig(rig, tmp_path / "a.usdc", clips)
    outcome = export_scene(tmp_path / "a.usdc", tmp_path / "b.glb", every_frame=True)
    each = outcome.details["certificate"]["clips"]
    assert list(each) == [clip.name for clip in clips]
    assert sum(part["frames"] for part in each.values()) == outcome.details["certificate"]["frames"]
    assert all(part["vertex_error_max_mm"] < 0.02 for part in each.values())


def test_another_movement_of_a_joint_is_seen(tmp_path: Path) -> None:
    rig, clips = a_character(3)
    assert clips[-1].joints is not None
    write_rig(rig, tmp_path / "a.usdc", clips)
    moved = replace(clips[-1].joints, translations=clips[-1].joints.translations + 0.01)
    write_gltf(rig, tmp_path / "b.glb", (*clips[:-1], replace(clips[-1], joints=moved)))
    stage = open_stage(tmp_path / "a.usdc")
    certificate, found = certify_conversion(
        stage, tmp_path / "b.glb", exported=True, every_frame=True
    )
    assert certificate is not None and certificate.vertex_largest > 1e-3
    assert [f.code for f in found] == ["CONVERSION_INEXACT"]


@pytest.mark.parametrize("seed", [0, 1])
def test_prims_that_move_hang_on_joints(tmp_path: Path, seed: int) -> None:
    rig, clips = a_character(seed)
    write_rig(rig, tmp_path / "a.usda", clips[:1])
    stage = Usd.Stage.Open(str(tmp_path / "a.usda"))
    for path in ("/Asset/Face", "/Asset/Face/Still"):
        prim = UsdGeom.Xformable(stage.GetPrimAtPath(path))
        move = prim.AddTranslateOp()
        for code in (0, 3, 30):
            move.Set(Gf.Vec3d(code / 10, 1, -code / 20), code)
    stage.Save()
    outcome = export_scene(tmp_path / "a.usda", tmp_path / "b.glb", every_frame=True)
    assert [f for f in outcome.findings if f.severity != "info"] == []
    back = import_scene(tmp_path / "b.glb", tmp_path / "c.usda", every_frame=True)
    assert [f for f in back.findings if f.severity != "info"] == []
    skeleton = read_gltf(tmp_path / "b.glb")[0].skeleton
    assert skeleton is not None
    assert skeleton.joints[:2] == ("Still", "Face")
    assert skeleton.joints[2:] == tuple(f"Face/{joint}" for joint in JOINTS)


def test_names_that_are_there_twice_come_back(tmp_path: Path, write_glb) -> None:
    points = np.eye(3, dtype="<f4")
    targets = [{"POSITION": 1}, {"POSITION": 2}, {"POSITION": 1}]
    primitive = {"attributes": {"POSITION": 0}, "targets": targets}
    names = ["Mund ü", "Mund ü", "口"]
    arrays = [points, points * 2, points * 3, np.array([0, 1], "<f4")]
    arrays += [np.arange(6, dtype="<f4"), np.arange(6, 0, -1).astype("<f4")]
    document = {
        "meshes": [{"primitives": [primitive], "extras": {"targetNames": names}}] * 2,
        "nodes": [{"mesh": 0, "name": "A"}, {"mesh": 1, "name": "B"}],
        "scenes": [{"nodes": [0, 1]}],
        "animations": [
            {
                "name": "clip 口",
                "samplers": [{"input": 3, "output": 4}, {"input": 3, "output": 5}],
                "channels": [
                    {"sampler": k, "target": {"node": k, "path": "weights"}} for k in (0, 1)
                ],
            }
        ],
    }
    write_glb(tmp_path / "a.glb", document, arrays)
    there = import_scene(tmp_path / "a.glb", tmp_path / "b.usda", every_frame=True)
    back = export_scene(tmp_path / "b.usda", tmp_path / "c.gltf", every_frame=True)
    assert [f for f in there.findings + back.findings if f.severity != "info"] == []
    written = json.loads((tmp_path / "c.gltf").read_text())
    assert [mesh["extras"]["targetNames"] for mesh in written["meshes"]] == [names, names]
    assert written["animations"][0]["name"] == "clip 口"
    # and once more: what was made unique stays so
    import_scene(tmp_path / "c.gltf", tmp_path / "d.usda")
    rigs = [animated_rig(open_stage(tmp_path / f"{name}.usda"))[0] for name in "bd"]
    assert rigs[0].shape_names == rigs[1].shape_names
    assert len(set(rigs[0].shape_names)) == 6
    assert [s.label or s.name for s in rigs[1].meshes[1].shapes] == names


def test_one_clip_of_several_is_exported(tmp_path: Path, capfd) -> None:
    rig, clips = a_character(2)
    write_rig(rig, tmp_path / "a.usdc", clips)
    command = ["export", str(tmp_path / "a.usdc"), "-o", str(tmp_path / "b.glb"), "--strict"]
    assert main([*command, "--clip", clips[1].name, "--pointer"]) == 0
    assert_same(clips[1:2], read_gltf(tmp_path / "b.glb")[1])
    assert main([*command, "--clip", "nobody"]) == 1
    assert repr(clips[0].name) in capfd.readouterr().err


def test_the_variant_chooses_what_plays(tmp_path: Path, assert_valid_usd) -> None:
    rig, clips = a_character(2)
    write_rig(rig, tmp_path / "a.usda", clips)
    assert_valid_usd(tmp_path / "a.usda")
    stage = Usd.Stage.Open(str(tmp_path / "a.usda"))
    variants = stage.GetPrimAtPath("/Asset/Face").GetVariantSet("animation")
    assert len(variants.GetVariantNames()) == len(clips)
    found = {clip.name: clip for clip in animated_rig(stage)[1]}
    for variant in variants.GetVariantNames():
        variants.SetVariantSelection(variant)
        first = animated_rig(stage)[1][0]  # what the stage shows comes first
        assert_same((found[first.name],), (first,))
    assert len(found) == len(clips)


@pytest.mark.slow
def test_the_robot_goes_in_and_out_with_all_clips(
    shared_data: Path, tmp_path: Path, validate_gltf, assert_valid_usd
) -> None:
    robot = shared_data / "robotexpressive" / "RobotExpressive.glb"
    there = import_scene(robot, tmp_path / "a.usdc", every_frame=True)
    assert_valid_usd(tmp_path / "a.usdc")
    options = ExportOptions(pointer=True)
    back = export_scene(tmp_path / "a.usdc", tmp_path / "b.glb", every_frame=True, options=options)
    for outcome in (there, back):
        certificate = outcome.details["certificate"]
        assert len(certificate["clips"]) == 14
        assert certificate["vertex_error_max_mm"] < 0.02
        assert certificate["weight_error_max"] < 1e-6
        assert certificate["time_drift_s"] < 1e-6
        assert certificate["missing"] == []
    names = [[clip.name for clip in read_gltf(path)[1]] for path in (robot, tmp_path / "b.glb")]
    assert names[0] == names[1]
    issues = validate_gltf(tmp_path / "b.glb")["issues"]
    assert issues["numErrors"] == 0, issues["messages"][:3]


@pytest.mark.slow
def test_clips_of_different_rates_share_one_clock(tmp_path: Path) -> None:
    rig, _ = a_character(0)
    clips = tuple(
        Clip(name, WeightsTake(rig.shape_names, times, np.cos(times[:, None] + [0, 1]), rate))
        for name, rate in (("24", 24.0), ("29.97", 30000 / 1001), ("120", 120.0))
        for times in [3 + np.arange(50) / rate]
    )
    write_rig(rig, tmp_path / "a.usda", clips)
    outcome = export_scene(tmp_path / "a.usda", tmp_path / "b.glb", every_frame=True)
    back = import_scene(tmp_path / "b.glb", tmp_path / "c.usda", every_frame=True)
    assert [f for f in outcome.findings + back.findings if f.severity != "info"] == []
    for name in "ac":
        others = animated_rig(open_stage(tmp_path / f"{name}.usda"))[1]
        assert [clip.name for clip in others] == ["24", "29.97", "120"]
        for clip, other in zip(clips, others, strict=True):
            assert other.rate == pytest.approx(clip.rate, rel=1e-3)
            np.testing.assert_allclose(other.times, clip.times, atol=1e-6)
