import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from clips import plays, read_one
from scipy.spatial.transform import Rotation

from usdface.certificate import compare
from usdface.certificate.certificate import Certificate
from usdface.cli import main
from usdface.clips import Clip, JointsTake
from usdface.io.compare_conversion import certify_conversion
from usdface.io.gltf.read import read_gltf
from usdface.io.gltf.write import write_gltf
from usdface.io.transforms import decompose
from usdface.io.usd.evaluate import UsdMesh
from usdface.io.usd.rig_write import write_rig
from usdface.io.usd.stage import open_stage
from usdface.pipeline import export_scene, import_scene
from usdface.rigs import Rig
from usdface.takes import WeightsTake


def take_for(rig: Rig, keys: int = 30) -> WeightsTake:
    times = 0.5 + np.arange(keys) / 60
    phases = 10 * times[:, None] + np.arange(len(rig.shape_names))
    return WeightsTake(rig.shape_names, times, 0.5 + 1.5 * np.sin(phases), 60.0)


@pytest.mark.parametrize("exported", [True, False])
@pytest.mark.parametrize("which", ["face_rig", "skinned_rig"])
def test_equal_animations_are_certified(tmp_path: Path, request, which: str, exported) -> None:
    rig = request.getfixturevalue(which)
    if exported:
        write_rig(rig, tmp_path / "a.usdc", plays(take_for(rig)))
        export_scene(tmp_path / "a.usdc", tmp_path / "a.glb")
    else:
        write_gltf(rig, tmp_path / "a.glb", plays(take_for(rig)))
        import_scene(tmp_path / "a.glb", tmp_path / "a.usdc")
    stage = open_stage(tmp_path / "a.usdc")
    certificate, found = certify_conversion(
        stage, tmp_path / "a.glb", exported=exported, every_frame=True
    )
    assert found == [] and certificate is not None
    assert certificate.vertex_largest < 2e-7
    assert certificate.normal_largest is not None and certificate.normal_largest < 1e-3
    assert max(certificate.weights.values()) < 1e-6
    assert certificate.time_drift < 1e-6
    assert certificate.frames == certificate.of_frames > 30  # with keys at the inbetweens
    assert certificate.names == {} and certificate.missing == ()


@pytest.mark.parametrize("angle", [0.0, 0.3])
def test_clips_of_one_key_are_on_both_sides(tmp_path: Path, skinned_rig: Rig, angle) -> None:
    joints = skinned_rig.skeleton.joints
    turn = np.array([0.0, 0.0, np.sin(angle), np.cos(angle)])
    move, rest, size = decompose(skinned_rig.skeleton.rest)

    def clip(name: str, keys: int, turned: bool) -> Clip:
        turns = np.tile(turn if turned else rest[1], (keys, 1, 1))
        return Clip(
            name,
            joints=JointsTake(
                joints[1:],
                np.arange(keys) / 24,
                np.tile(move[1], (keys, 1, 1)),
                turns,
                np.tile(size[1], (keys, 1, 1)),
                24.0,
            ),
        )

    clips = [clip("walk", 3, True), clip("stand", 1, angle > 0)]
    write_rig(skinned_rig, tmp_path / "a.usdc", clips)
    for leg in (
        export_scene(tmp_path / "a.usdc", tmp_path / "a.glb", every_frame=True),
        import_scene(tmp_path / "a.glb", tmp_path / "b.usdc", every_frame=True),
    ):
        assert leg.value.missing == () and leg.summary["clips"] == 2
        assert "CONVERSION_INEXACT" not in {f.code for f in leg.findings}


def test_another_animation_is_not(tmp_path: Path, face_rig: Rig) -> None:
    take = take_for(face_rig)
    write_rig(face_rig, tmp_path / "a.usdc", plays(take))
    slower = WeightsTake(take.names, take.times * 2, take.weights)
    write_gltf(face_rig, tmp_path / "slow.glb", plays(slower))
    write_gltf(face_rig, tmp_path / "still.glb")
    for name, drift in (("slow.glb", 0.24), ("still.glb", -1)):
        stage = open_stage(tmp_path / "a.usdc")
        certificate, found = certify_conversion(
            stage, tmp_path / name, exported=True, every_frame=True
        )
        assert certificate is not None and certificate.time_drift > drift
        assert certificate.vertex_largest > 1e-3
        assert [f.code for f in found] == ["CONVERSION_INEXACT"]


def test_what_cannot_be_evaluated_is_said(tmp_path: Path, face_rig: Rig) -> None:
    write_rig(face_rig, tmp_path / "a.usdc")
    (tmp_path / "a.gltf").write_text('{"extensionsRequired": ["EXT_unheard_of"]}')
    stage = open_stage(tmp_path / "a.usdc")
    certificate, found = certify_conversion(
        stage, tmp_path / "a.gltf", exported=False, every_frame=True
    )
    assert certificate is None
    assert [f.code for f in found] == ["CONVERSION_UNCERTIFIED"]


def test_steps_keep_their_times(tmp_path: Path, write_glb) -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4")
    times = (np.array([0, 30, 60, 61, 3600]) / 60).astype("<f4")
    arrays = [points, points[::-1].copy(), times, np.array([0, 1, 0.5, 0.7, 0.2], "<f4")]
    primitive = {"attributes": {"POSITION": 0}, "targets": [{"POSITION": 1}]}
    sampler = {"input": 2, "output": 3, "interpolation": "STEP"}
    channel = {"sampler": 0, "target": {"node": 0, "path": "weights"}}
    document = {
        "meshes": [{"primitives": [primitive]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
        "animations": [{"samplers": [sampler], "channels": [channel]}],
    }
    path = write_glb(tmp_path / "a.glb", document, arrays)
    rig, take, _ = read_one(path)
    write_rig(rig, tmp_path / "a.usdc", plays(take))
    stage = open_stage(tmp_path / "a.usdc")
    certificate, found = certify_conversion(stage, path, exported=False, every_frame=True)
    assert found == [] and certificate is not None
    assert max(certificate.weights.values()) < 1e-6


def test_the_command_line_reports_it(tmp_path: Path, face_rig: Rig, capfd) -> None:
    materials = tuple(replace(m, double_sided=True) for m in face_rig.materials)
    rig = replace(face_rig, materials=materials)  # sides that differ would be a loss
    write_rig(rig, tmp_path / "a.usdc", plays(take_for(rig)))
    usd, glb, back = (str(tmp_path / name) for name in ("a.usdc", "a.glb", "b.usdc"))
    report = tmp_path / "r.json"
    for command in (["export", usd, "-o", glb], ["import", glb, "-o", back]):
        assert main([*command, "--report", str(report), "--strict"]) == 0
        assert "vertex error max [mm]" in capfd.readouterr().out
        certificate = json.loads(report.read_text())["certificate"]
        assert certificate["frames_compared"] == certificate["frames"]
        assert certificate["vertex_error_max_mm"] < 2e-4
        assert set(certificate["weight_errors"]) >= {"Head/口", "Head/Key.1"}


def under_a_moving_head(rig: Rig, keys: int) -> Clip:
    """Weights, and two joints that turn and move, in `keys` frames."""
    assert rig.skeleton is not None
    move, turn, size = decompose(rig.skeleton.rest)
    phase = np.linspace(0, 6, keys)[:, None]
    swing = Rotation.from_rotvec(np.concatenate([0.3 * np.sin(phase), phase / 9, 0 * phase], 1))
    turns = np.stack([(Rotation.from_quat(r) * swing).as_quat() for r in turn], 1)
    moves = move[None] + 0.05 * np.sin(phase)[..., None]
    joints = JointsTake(
        rig.skeleton.joints,
        np.arange(keys) / 24,
        moves,
        turns,
        np.broadcast_to(size, (keys, *size.shape)),
        24.0,
    )
    return Clip("head", replace(take_for(rig, keys), times=joints.times, rate=24.0), joints)


@pytest.mark.parametrize("off", [0.0, 2e-3])
def test_a_moving_head_is_certified_by_its_joints(
    tmp_path: Path, skinned_rig: Rig, monkeypatch: pytest.MonkeyPatch, off: float
) -> None:
    """The same as if every frame was evaluated, which only 20 and those of strong shapes are."""
    clip = under_a_moving_head(skinned_rig, 150)
    write_rig(skinned_rig, tmp_path / "a.usdc", [clip])
    shown = replace(
        skinned_rig.meshes[0], points=skinned_rig.meshes[0].points + np.array([off, 0, 0])
    )
    write_gltf(replace(skinned_rig, meshes=(shown,)), tmp_path / "a.glb", [clip])
    evaluated: list[int] = []
    inside = UsdMesh.points_at
    monkeypatch.setattr(
        UsdMesh,
        "points_at",
        lambda mesh, codes: evaluated.append(len(codes)) or inside(mesh, codes),
    )

    def certify(most: int) -> Certificate:
        monkeypatch.setattr(compare, "_SUMMED_FRAMES", most)
        evaluated.clear()
        certificate, _ = certify_conversion(
            open_stage(tmp_path / "a.usdc"), tmp_path / "a.glb", exported=True, every_frame=True
        )
        assert certificate is not None and certificate.frames >= 150
        return certificate

    slow = certify(10**9)
    assert sum(evaluated) > 150
    quick = certify(100)
    assert sum(evaluated) < 80
    assert (quick.vertex_largest > 1e-3) == (off > 0)
    np.testing.assert_allclose(quick.vertex_largest, slow.vertex_largest, rtol=1e-4, atol=1e-7)
    np.testing.assert_allclose(quick.vertex_mean, slow.vertex_mean, rtol=1e-4, atol=1e-7)
    assert quick.normal_largest is not None and slow.normal_largest is not None
    np.testing.assert_allclose(quick.normal_largest, slow.normal_largest, atol=1e-4)


def cubic_face(write_glb, path: Path) -> Path:
    """A mesh whose two weights are eased between keys, as animators leave them."""
    points = np.eye(3, dtype="<f4")
    times = np.array([0, 0.5, 1.25, 2], "<f4")[:, None]
    keys = np.zeros((4, 3, 2), "<f4")
    keys[:, 1] = [[0, 0], [1, 0.2], [0.3, 0.9], [0, 0]]
    sampler = {"input": 2, "output": 3, "interpolation": "CUBICSPLINE"}
    channel = {"sampler": 0, "target": {"node": 0, "path": "weights"}}
    targets = [{"POSITION": 1}] * 2
    document = {
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [
            {
                "primitives": [{"attributes": {"POSITION": 0}, "targets": targets}],
                "extras": {"targetNames": ["jawOpen", "smile"]},
            }
        ],
        "animations": [{"name": "ease", "channels": [channel], "samplers": [sampler]}],
    }
    return write_glb(path, document, [points, 0.1 * points, times, keys.reshape(-1, 1)])


def test_cubic_weights_are_imported_within_the_limit(tmp_path: Path, write_glb) -> None:
    path = cubic_face(write_glb, tmp_path / "a.glb")
    done = import_scene(path, tmp_path / "a.usdc", every_frame=True)
    codes = {f.code for f in done.findings}
    assert "CURVE_RESAMPLED" in codes and "CONVERSION_INEXACT" not in codes
    assert 1e-6 < done.summary["weight_error_max"] < 1e-5


def test_lines_that_miss_a_curve_between_their_keys_are_found(tmp_path: Path, write_glb) -> None:
    path = cubic_face(write_glb, tmp_path / "a.glb")
    rig, (clip,), _ = read_gltf(path)
    own = clip.weights
    kept = np.arange(len(own.times)) % 8 == 0
    kept[-1] = True
    fewer = replace(own, times=own.times[kept], weights=own.weights[kept])
    write_rig(rig, tmp_path / "a.usdc", [replace(clip, weights=fewer)])
    certificate, found = certify_conversion(
        open_stage(tmp_path / "a.usdc"), path, exported=False, every_frame=True
    )
    many = np.linspace(0, 2, 20_001)
    off = max(
        np.abs(
            np.interp(many, own.times, own.weights[:, k])
            - np.interp(many, fewer.times, fewer.weights[:, k])
        ).max()
        for k in range(2)
    )
    assert [f.code for f in found] == ["CONVERSION_INEXACT"]
    assert max(certificate.weights.values()) == pytest.approx(off, rel=0.1)
