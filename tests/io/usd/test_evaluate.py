from pathlib import Path

import numpy as np
import pytest
from clips import plays
from pxr import UsdSkel, Vt

from usdface.clips import Clip, JointsTake
from usdface.io.usd.evaluate import evaluate_usd, stage_keys
from usdface.io.usd.rig_write import write_rig
from usdface.io.usd.stage import open_stage
from usdface.rigs import Rig
from usdface.takes import WeightsTake


def take_for(rig: Rig) -> WeightsTake:
    rng = np.random.default_rng(1)
    weights = rng.uniform(-1, 2, (7, len(rig.shape_names)))
    return WeightsTake(rig.shape_names, np.arange(7) / 30, weights, 30.0)


def test_it_is_what_baking_gives(tmp_path: Path, face_rig: Rig, skinned_rig: Rig, baked) -> None:
    for rig in (face_rig, skinned_rig):
        path = tmp_path / f"{rig.name}.usda"
        write_rig(rig, path, plays(take_for(rig)))
        stage = open_stage(path)
        _, codes, times = stage_keys(stage)
        np.testing.assert_allclose(times, take_for(rig).times, atol=1e-12)
        for mesh, points in zip(evaluate_usd(stage), baked(path, codes).values(), strict=True):
            np.testing.assert_allclose(mesh.points_at(codes), points[:, mesh.used], atol=1e-7)
            weights = take_for(rig).reordered(mesh.shapes).weights
            np.testing.assert_allclose(mesh.weights_at(codes), weights, atol=1e-6)


def test_joints_in_an_order_of_the_mesh(tmp_path: Path, skinned_rig: Rig, baked) -> None:
    turned = np.array([[[0, 0, 0, 1], [0.6, 0, 0, 0.8]]] * 2)
    neck, head = skinned_rig.skeleton.rest[:, 3, :3]
    moves = np.array([[neck, head], [neck, head + 0.1]])
    take = JointsTake(
        skinned_rig.skeleton.joints, np.array([0.0, 1.0]), moves, turned, np.ones((2, 2, 3)), 24.0
    )
    path = tmp_path / "a.usda"
    write_rig(skinned_rig, path, [Clip("nod", joints=take)])
    stage = open_stage(path)
    binding = UsdSkel.BindingAPI(stage.GetPrimAtPath("/Asset/Face/Head"))
    binding.CreateJointsAttr(skinned_rig.skeleton.joints[::-1])
    indices = binding.GetJointIndicesPrimvar()
    indices.Set(Vt.IntArray.FromNumpy(1 - np.array(indices.Get())))
    stage.Save()
    codes = np.array([0.0, 12.0, 24.0])
    (mesh,) = evaluate_usd(stage)
    (points,) = baked(path, codes).values()
    np.testing.assert_allclose(mesh.points_at(codes), points[:, mesh.used], atol=1e-6)
    assert np.ptp(points, axis=0).max() > 0.1


@pytest.mark.parametrize("name", ["blendshapes", "blendshapesWithNormals"])
def test_it_is_what_the_published_baseline_says(shared_data: Path, name: str) -> None:
    from pxr import Usd, UsdGeom

    folder = shared_data / "openusd_usdskel/bakeSkinning"
    stage = open_stage(folder / f"{name}.usda")
    codes = np.arange(1.0, stage.GetEndTimeCode() + 1)
    mesh = evaluate_usd(stage)[0]  # behind it the truth, outside of the SkelRoot
    baseline = Usd.Stage.Open(str(folder / f"baseline/{name}.baked.usda"))
    plane = UsdGeom.Mesh(baseline.GetPrimAtPath("/TestPlane/Mesh"))
    points = np.array([plane.GetPointsAttr().Get(code) for code in codes])
    if UsdGeom.GetStageUpAxis(stage) == "Z":
        points = points[..., [0, 2, 1]] * [1, 1, -1]
    np.testing.assert_allclose(mesh.points_at(codes) * 100, points, atol=1e-4)
    normals = mesh.normals_at(codes)
    assert (normals is None) == (name == "blendshapes")
    if normals is not None:
        theirs = np.array([plane.GetNormalsAttr().Get(code) for code in codes], float)
        theirs /= np.linalg.norm(theirs, axis=2, keepdims=True)
        if UsdGeom.GetStageUpAxis(stage) == "Z":
            theirs = theirs[..., [0, 2, 1]] * [1, 1, -1]
        np.testing.assert_allclose(normals, theirs, atol=1e-5)
