"""Quantized export: small, within its stated bound, and moved as before."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from clips import evaluate_gltf

from usdface.clips import Clip, JointsTake
from usdface.io.gltf import buffer
from usdface.io.gltf.quantize import Box, bounding_box
from usdface.io.gltf.read import read_gltf
from usdface.io.gltf.write import write_gltf
from usdface.io.transforms import decompose
from usdface.io.usd.rig_write import write_rig
from usdface.options import ExportOptions
from usdface.pipeline import export_scene
from usdface.rigs import BlendShape, CornerValues, Mesh, Rig
from usdface.takes import WeightsTake


def written(rig: Rig, folder: Path, clips: list[Clip] | None = None) -> tuple[Path, Path]:
    plain, small = folder / "plain.glb", folder / "small.glb"
    write_gltf(rig, plain, clips or [])
    found = write_gltf(rig, small, clips or [], ExportOptions(quantize=True))
    assert [f.code for f in found].count("POINTS_ROUNDED") == len(rig.meshes)
    return plain, small


def assert_within_bounds(rig: Rig, plain: Path, small: Path, times: np.ndarray) -> None:
    one, two = evaluate_gltf(plain), evaluate_gltf(small)
    for mesh, exact, rounded in zip(rig.meshes, one, two, strict=True):
        weights = np.abs(exact.weights_at(times)).sum(axis=1).max(initial=0.0)
        bound = bounding_box(mesh).error * (1 + weights) + 1e-7
        off = np.linalg.norm(rounded.points_at(times) - exact.points_at(times), axis=-1)
        assert off.max() <= bound
        a, b = exact.normals_at(times), rounded.normals_at(times)
        if a is not None and b is not None:
            assert np.abs(b - a).max() < 1e-3


def a_clip(rig: Rig) -> Clip:
    times = np.linspace(0, 1, 5)
    weights = np.random.default_rng(0).uniform(-0.5, 1.5, (5, len(rig.shape_names)))
    return Clip("a", WeightsTake(rig.shape_names, times, weights, 4.0))


@pytest.mark.parametrize("kind", ["face_rig", "skinned_rig"])
def test_points_stay_within_the_stated_bound(
    tmp_path: Path, request: pytest.FixtureRequest, kind: str, validate_gltf: Callable
) -> None:
    rig = request.getfixturevalue(kind)
    plain, small = written(rig, tmp_path, [a_clip(rig)])
    assert_within_bounds(rig, plain, small, np.linspace(0, 1, 5))
    report = validate_gltf(small)
    assert report["issues"]["numErrors"] == 0, report
    back = read_gltf(small)[0]
    first = read_gltf(plain)[0]
    for one, two in zip(first.meshes, back.meshes, strict=True):
        assert one.shape_names == two.shape_names
        assert np.abs(np.sort(one.points, axis=0) - np.sort(two.points, axis=0)).max() < 1e-5


def test_all_attributes_become_shorts_where_they_fit(
    tmp_path: Path, validate_gltf: Callable
) -> None:
    rng = np.random.default_rng(1)
    count = 300
    points = rng.normal(size=(count, 3))
    faces = np.concatenate([rng.permutation(count), rng.permutation(count)])
    normals = rng.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    tangents = np.c_[normals[faces][:, [1, 2, 0]], np.ones(len(faces))]
    shape = BlendShape("a", np.arange(count), rng.normal(size=(count, 3)), normals * 0.1)
    held = (
        CornerValues("displayColor", rng.random((len(faces), 4))),
        CornerValues("tangents", tangents),
        CornerValues("st1", rng.normal(size=(len(faces), 2))),  # beyond 0 to 1: stays float
    )
    counts = np.full(len(faces) // 3, 3)
    mesh = Mesh("m", points, counts, faces, normals, rng.random((len(faces), 2)), (shape,))
    rig = Rig("r", (replace(mesh, corner_values=held),))
    plain, small = written(rig, tmp_path)
    assert small.stat().st_size < 0.75 * plain.stat().st_size
    report = validate_gltf(small)
    assert report["issues"]["numErrors"] == 0, report
    (one,), (two,) = (read_gltf(path)[0].meshes for path in (plain, small))
    for name, limit in (("displayColor", 2e-5), ("tangents", 1e-4), ("st1", 0)):
        a, b = one.corners(name), two.corners(name)
        assert a is not None and b is not None
        np.testing.assert_allclose(b, a, rtol=0, atol=limit)


def test_a_mesh_without_extent_is_written(tmp_path: Path) -> None:
    rig = Rig("r", (Mesh("m", np.ones((3, 3)), [3], [0, 1, 2]),))
    _, small = written(rig, tmp_path)
    np.testing.assert_array_equal(read_gltf(small)[0].meshes[0].points[0], [1, 1, 1])


def test_two_runs_give_the_same_bytes(tmp_path: Path, skinned_rig: Rig) -> None:
    _, small = written(skinned_rig, tmp_path)
    first = small.read_bytes()
    assert written(skinned_rig, tmp_path)[1].read_bytes() == first


def moving(rig: Rig) -> list[Clip]:
    """A clip of 120 frames: enough for the sums of the certificate."""
    take = WeightsTake(
        rig.shape_names,
        np.arange(120) / 30,
        np.random.default_rng(2).uniform(-0.5, 1.5, (120, len(rig.shape_names))),
        30.0,
    )
    if rig.skeleton is None:
        return [Clip("a", take)]
    move, _, size = decompose(rig.skeleton.rest)
    half = np.linspace(0, 0.3, 120)[:, None, None] * np.ones((1, len(move), 1))
    turns = np.concatenate([0 * half, 0 * half, np.sin(half), np.cos(half)], -1)
    stretched = np.broadcast_to(2 * size, (120, *size.shape))
    still = np.broadcast_to(move, (120, *move.shape))
    joints = JointsTake(rig.skeleton.joints, take.times, still, turns, stretched, 30.0)
    return [Clip("a", take, joints)]


@pytest.mark.parametrize("every_frame", [True, False])
@pytest.mark.parametrize("kind", ["face_rig", "skinned_rig"])
def test_the_rounding_that_was_asked_for_is_no_warning(
    tmp_path: Path, request: pytest.FixtureRequest, kind: str, every_frame: bool
) -> None:
    rig = request.getfixturevalue(kind)
    write_rig(rig, tmp_path / "a.usdc", moving(rig))
    done = export_scene(
        tmp_path / "a.usdc",
        tmp_path / "a.glb",
        options=ExportOptions(quantize=True),
        every_frame=every_frame,
    )
    assert "CONVERSION_INEXACT" not in {f.code for f in done.findings}
    found = done.details["certificate"]
    limit = 1e-5 * found["bounding_diagonal_mm"]
    assert found["vertex_error_max_mm"] > limit  # it is rounded, and that shows
    assert found["vertex_error_max_mm"] <= found["vertex_rounding_max_mm"] + limit
    plain = export_scene(tmp_path / "a.usdc", tmp_path / "b.glb").details["certificate"]
    assert plain["vertex_rounding_max_mm"] == plain["normal_rounding_max_degrees"] == 0


@pytest.mark.parametrize("wrong", ["coarse", "small"])
@pytest.mark.parametrize("kind", ["face_rig", "skinned_rig"])
def test_more_than_that_rounding_is_a_warning(
    tmp_path: Path,
    request: pytest.FixtureRequest,
    monkeypatch: pytest.MonkeyPatch,
    kind: str,
    wrong: str,
) -> None:
    """Numbers in steps of 64, and offsets that are too small by a thousandth."""
    rig = request.getfixturevalue(kind)
    write_rig(rig, tmp_path / "a.usdc", moving(rig))
    if wrong == "coarse":
        exact = buffer._shortened
        monkeypatch.setattr(buffer, "_shortened", lambda v, s: exact(v, s) // 64 * 64)
    else:
        boxed = Box.boxed
        monkeypatch.setattr(
            Box, "boxed", lambda box, mesh: boxed(replace(box, size=1.001 * box.size), mesh)
        )
    done = export_scene(
        tmp_path / "a.usdc", tmp_path / "a.glb", options=ExportOptions(quantize=True)
    )
    (found,) = [f for f in done.findings if f.code == "CONVERSION_INEXACT"]
    assert found.severity == "warning" and "vertices by" in found.message
