"""USD to glTF to USD and glTF to USD to glTF give back what went in."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from clips import plays, read_one, weights_of_stage

from usdface.io.gltf.write import write_gltf
from usdface.io.usd.rig import rig_of_stage
from usdface.io.usd.rig_write import write_rig
from usdface.io.usd.stage import open_stage
from usdface.pipeline import export_scene, import_scene
from usdface.rigs import BlendShape, Inbetween, Mesh, Rig
from usdface.takes import WeightsTake

NAMES = ("Mund öffnen", "口 を開く", "Key 1", "Key.1", "1x", "a:b", "a:b:half", "é", "/../x", "ß")
MESHES = ("Kopf ü", "Zähne/oben", "舌", "Key 1", "Key.1")


def a_rig(seed: int) -> tuple[Rig, WeightsTake]:
    rng = np.random.default_rng(seed)
    names = rng.permutation(NAMES).tolist()[: rng.integers(2, len(NAMES))]

    def a_shape(name: str, count: int) -> BlendShape:
        indices = np.flatnonzero(rng.random(count) < 0.6)
        offsets = rng.normal(0, 0.01, (3, len(indices), 3))
        places = rng.choice([-0.5, 0.25, 0.5, 0.8, 1.5], rng.integers(0, 3), replace=False)
        turns = rng.normal(0, 0.1, (3, len(indices), 3))
        between = tuple(
            Inbetween(f"{name} bei {place:g}", place, *pair)
            for place, *pair in zip(np.sort(places), offsets[1:], turns[1:], strict=False)
        )
        return BlendShape(name, indices, offsets[0], turns[0], between)

    def a_mesh(name: str) -> Mesh:
        count = int(rng.integers(6, 20))
        points = rng.normal(size=(count, 3))
        faces = np.concatenate([rng.permutation(count), rng.permutation(count)])
        faces = faces[: len(faces) // 3 * 3]
        every = np.concatenate([faces, np.arange(count), np.arange(3 - count % 3)])
        normals = rng.normal(size=(count, 3))
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        own = [n for n in names if rng.random() < 0.7]
        shapes = tuple(a_shape(n, count) for n in own)
        uvs = rng.random((len(every), 2)) if rng.random() < 0.5 else None
        counts = np.full(len(every) // 3, 3)
        return Mesh(name, points, counts, every, normals, uvs, shapes)

    meshes = tuple(a_mesh(name) for name in rng.permutation(MESHES)[: rng.integers(1, 4)])
    rig = Rig("Gesicht ü 口", meshes)
    times = np.arange(12) / 30
    phases = 8 * times[:, None] + rng.uniform(0, 6, len(rig.shape_names))
    return rig, WeightsTake(rig.shape_names, times, 0.5 + 1.4 * np.sin(phases), 30.0)


def assert_same(one: Rig, take: WeightsTake, other: Rig, again: WeightsTake | None) -> None:
    assert other.name == one.name
    assert [m.name for m in other.meshes] == [m.name for m in one.meshes]
    assert again is not None
    assert set(again.names) == set(take.names)
    np.testing.assert_allclose(again.times, take.times, atol=1e-6)
    np.testing.assert_allclose(again.reordered(take.names).weights, take.weights, atol=1e-6)
    assert again.rate == pytest.approx(take.rate, abs=1e-3)
    for a, b in zip(one.meshes, other.meshes, strict=True):
        size = np.linalg.norm(np.ptp(a.points, axis=0))
        assert a.shape_names == b.shape_names
        assert a.normals is not None and b.normals is not None
        corners, theirs = a.face_indices, b.face_indices
        np.testing.assert_allclose(b.points[theirs], a.points[corners], atol=1e-5 * size)
        np.testing.assert_allclose(b.normals[theirs], a.normals[corners], atol=1e-5)
        for mine, its in zip(a.shapes, b.shapes, strict=True):
            assert [(x.name, pytest.approx(x.weight, abs=1e-7)) for x in mine.inbetweens] == [
                (x.name, x.weight) for x in its.inbetweens
            ]
            for x, y in zip((mine, *mine.inbetweens), (its, *its.inbetweens), strict=True):
                for field, limit in (("offsets", 1e-5 * size), ("normal_offsets", 1e-5)):
                    dense = np.zeros((2, max(len(a.points), len(b.points)), 3))
                    dense[0, mine.indices] = getattr(x, field)
                    dense[1, its.indices] = getattr(y, field)
                    np.testing.assert_allclose(dense[1][theirs], dense[0][corners], atol=limit)


def read_usd(path: Path) -> tuple[Rig, WeightsTake | None]:
    stage = open_stage(path)
    return rig_of_stage(stage)[0], weights_of_stage(stage)


@pytest.mark.slow
@pytest.mark.parametrize(
    "seed", [*range(6), *(pytest.param(k, marks=pytest.mark.slow) for k in range(6, 12))]
)
def test_usd_to_gltf_to_usd(tmp_path: Path, seed: int) -> None:
    write_rig(*(rig := a_rig(seed))[:1], tmp_path / "a.usdc", plays(rig[1]))
    one, take = read_usd(tmp_path / "a.usdc")
    assert_same(*rig, one, take)
    there = export_scene(tmp_path / "a.usdc", tmp_path / "b.glb", every_frame=True)
    back = import_scene(tmp_path / "b.glb", tmp_path / "c.usdc", every_frame=True)
    assert [f for f in there.findings + back.findings if f.severity != "info"] == []
    other, again = read_usd(tmp_path / "c.usdc")
    assert take is not None
    assert_same(one, take, other, again)


@pytest.mark.slow
@pytest.mark.parametrize(
    "seed", [*range(12, 18), *(pytest.param(k, marks=pytest.mark.slow) for k in range(18, 24))]
)
def test_gltf_to_usd_to_gltf(tmp_path: Path, seed: int) -> None:
    write_gltf(*(rig := a_rig(seed))[:1], tmp_path / "a.glb", plays(rig[1]))
    one, take, _ = read_one(tmp_path / "a.glb")
    assert_same(*rig, one, take)
    there = import_scene(tmp_path / "a.glb", tmp_path / "b.usda", every_frame=True)
    back = export_scene(tmp_path / "b.usda", tmp_path / "c.glb", every_frame=True)
    assert [f for f in there.findings + back.findings if f.severity != "info"] == []
    other, again, _ = read_one(tmp_path / "c.glb")
    assert take is not None
    assert_same(one, take, other, again)


@pytest.mark.parametrize("suffix", [".glb", ".gltf"])
def test_meshes_may_share_a_name(tmp_path: Path, suffix: str) -> None:
    rig, take = a_rig(1)
    twice = replace(rig, meshes=tuple(replace(rig.meshes[0], name="Mesh") for _ in range(3)))
    write_rig(twice, tmp_path / "a.usdc", plays(take))
    export_scene(tmp_path / "a.usdc", tmp_path / f"b{suffix}")
    import_scene(tmp_path / f"b{suffix}", tmp_path / "c.usdc")
    other, again = read_usd(tmp_path / "c.usdc")
    assert_same(*read_usd(tmp_path / "a.usdc"), other, again)
