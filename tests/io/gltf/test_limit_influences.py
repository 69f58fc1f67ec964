"""Points cut down to their strongest joints are never farther off than the finding says."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from usdface.clips import Clip, JointsTake
from usdface.io.gltf import limit_influences as module
from usdface.io.gltf.limit_influences import limit_influences
from usdface.io.joint_poses import skinning_transforms
from usdface.io.usd.rig_write import write_rig
from usdface.options import ExportOptions
from usdface.pipeline import export_scene
from usdface.rigs import BlendShape, Mesh, Rig, Skeleton, Skin
from usdface.takes import WeightsTake

JOINTS = 6


def skeleton() -> Skeleton:
    names = tuple(f"j{k}" for k in range(JOINTS))
    stand = np.tile(np.eye(4), (JOINTS, 1, 1))
    stand[:, 3, :3] = 0.1 * np.arange(JOINTS)[:, None] * [1.0, 0.5, -0.25]
    return Skeleton(names, names, stand, stand)


def turning(frames: int = 7) -> Clip:
    rng = np.random.default_rng(3)
    stand, times = skeleton(), np.arange(frames) / 24
    moves = stand.rest[None, :, 3, :3] + 0.02 * rng.normal(size=(frames, JOINTS, 3))
    turns = np.array([0, 0, 0, 1]) + 0.3 * rng.normal(size=(frames, JOINTS, 4))
    turns /= np.linalg.norm(turns, axis=2, keepdims=True)
    joints = JointsTake(stand.joints, times, moves, turns, np.ones((frames, JOINTS, 3)), 24.0)
    return Clip("turn", WeightsTake(("s",), times, rng.uniform(size=(frames, 1)), 24.0), joints)


def mesh(shape: float = 0.0, count: int = 40) -> Mesh:
    rng = np.random.default_rng(4)
    weights = rng.dirichlet(np.ones(JOINTS), count)
    joints = np.tile(np.arange(JOINTS), (count, 1))
    moved = BlendShape("s", np.arange(count), shape * rng.normal(size=(count, 3)))
    faces = np.arange(count - count % 3)
    points = 0.2 * rng.normal(size=(count, 3))
    skin = Skin(joints, weights)
    return Mesh("face", points, [3] * (count // 3), faces, shapes=(moved,), skin=skin)


def posed(of: Mesh, clip: Clip) -> np.ndarray:
    """Points (F, V, 3) by the definition of linear blend skinning."""
    assert of.skin is not None and clip.weights is not None
    moves = skinning_transforms(skeleton(), clip.joints)
    points = of.points + clip.weights.weights[:, :, None] * of.shapes[0].offsets
    full = np.concatenate([points, np.ones((*points.shape[:2], 1))], axis=2)
    each = np.einsum("fvi,fvkij->fvkj", full, moves[:, of.skin.joints])
    return np.einsum("vk,fvkj->fvj", of.skin.weights, each)[..., :3]


def test_without_shapes_the_finding_is_the_largest_distance() -> None:
    given, clip = mesh(), turning()
    fewer, (reduced,) = limit_influences(given, skeleton(), [clip], 4)
    assert fewer.skin is not None and fewer.skin.joints.shape[1] == 4
    np.testing.assert_allclose(fewer.skin.weights.sum(axis=1), 1)
    off = 1e3 * np.linalg.norm(posed(fewer, clip) - posed(given, clip), axis=2).max()
    assert reduced.code == "INFLUENCES_REDUCED"
    assert reduced.values["error_mm"] == pytest.approx(off, rel=1e-4)
    same, (many,) = limit_influences(given, skeleton(), [clip])
    assert same is given and many.code == "INFLUENCES_MANY"
    assert many.values["error_mm"] == reduced.values["error_mm"]


def test_with_shapes_and_by_boxes_it_is_a_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    given, clip = mesh(0.02), turning()
    fewer, (computed,) = limit_influences(given, skeleton(), [clip], 4)
    off = 1e3 * np.linalg.norm(posed(fewer, clip) - posed(given, clip), axis=2).max()
    monkeypatch.setattr(module, "_MOST", 0)
    _, (boxed,) = limit_influences(given, skeleton(), [clip], 4)
    assert off <= computed.values["error_mm"] <= 1.5 * off
    assert computed.values["error_mm"] <= boxed.values["error_mm"]


def test_at_rest_nothing_is_off() -> None:
    _, (found,) = limit_influences(mesh(), skeleton(), [], 4)
    assert found.values["error_mm"] < 1e-4  # rounding of weights to float32


def test_few_joints_say_nothing() -> None:
    given = mesh()
    assert given.skin is not None
    few = np.where(np.arange(JOINTS) < 4, given.skin.weights, 0)
    four = replace(given, skin=Skin(given.skin.joints, few / few.sum(axis=1, keepdims=True)))
    assert limit_influences(four, skeleton(), [turning()], 4) == (four, [])


def test_usdskel_and_the_gltf_player_are_as_far_apart_as_said(
    tmp_path: Path, validate_gltf
) -> None:
    write_rig(Rig("r", (mesh(0.02),), skeleton()), tmp_path / "r.usda", [turning()])
    asked = ExportOptions(influences=4)
    done = export_scene(tmp_path / "r.usda", tmp_path / "r.glb", every_frame=True, options=asked)
    (bound,) = (f.values["error_mm"] for f in done.findings if f.code == "INFLUENCES_REDUCED")
    assert 0.5 * bound <= done.summary["vertex_error_max_mm"] <= bound * (1 + 1e-3)
    assert validate_gltf(tmp_path / "r.glb")["issues"]["numErrors"] == 0
    whole = export_scene(tmp_path / "r.usda", tmp_path / "r.glb", every_frame=True)
    assert whole.summary["vertex_error_max_mm"] < 1e-3  # all sets are written


def lit(of: Mesh) -> Mesh:
    """The mesh with normals, which its shape turns a little."""
    rng = np.random.default_rng(6)
    normals = rng.normal(size=of.points.shape)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    (shape,) = of.shapes
    turned = replace(shape, normal_offsets=0.1 * rng.normal(size=of.points.shape))
    return replace(of, normals=normals, shapes=(turned,))


def without_ties(of: Mesh) -> Mesh:
    return of


def with_ties(of: Mesh) -> Mesh:
    """The mesh whose joints all hold each point alike, two of them named twice."""
    count = len(of.points)
    joints = np.tile([5, 4, 3, 2, 1, 0, 1, 2], (count, 1))
    return replace(of, skin=Skin(joints, np.tile([2, 2, 2, 1, 1, 2, 1, 1], (count, 1)) / 12))


def export_of(tmp_path: Path, given: Mesh, frames: int, **asked: object):
    write_rig(Rig("r", (given,), skeleton()), tmp_path / "r.usda", [turning(frames)])
    options = ExportOptions(**asked)
    return export_scene(tmp_path / "r.usda", tmp_path / "r.glb", every_frame=True, options=options)


@pytest.mark.parametrize("frames", [7, 150])  # compared one by one, and as sums
@pytest.mark.parametrize("quantize", [False, True])
@pytest.mark.parametrize("skin", [without_ties, with_ties])
def test_what_was_asked_for_is_no_warning(tmp_path: Path, skin, quantize: bool, frames) -> None:
    given = lit(skin(mesh(0.02, 400)))
    done = export_of(tmp_path, given, frames, influences=4, quantize=quantize)
    assert {f.code for f in done.findings if f.severity == "warning"} == set()
    found = done.details["certificate"]
    assert found["vertex_error_max_mm"] > 5 and found["normal_error_max_degrees"] > 5


@pytest.mark.parametrize("frames", [7, 150])
def test_more_than_was_asked_for_is_a_warning(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, frames: int
) -> None:
    """A writer that keeps three joints where four were to stay."""
    cut = module._cut
    monkeypatch.setattr(module, "_cut", lambda *of: cut(*of[:-1], min(of[-1], 3)))
    done = export_of(tmp_path, lit(mesh(0.02, 400)), frames, influences=4)
    (found,) = [f for f in done.findings if f.code == "CONVERSION_INEXACT"]
    assert "vertices by" in found.message and "normals by" in found.message
