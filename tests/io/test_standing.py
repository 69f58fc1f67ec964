"""How a face stands without animation is kept, beside clips and on its own."""

import json
import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

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
