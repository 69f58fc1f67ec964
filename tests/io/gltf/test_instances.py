"""Instances of a mesh become nodes, up to a stated number; more are announced."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from usdface.errors import InputError
from usdface.io.gltf.read import read_gltf
from usdface.io.transforms import compose
from usdface.pipeline import export_scene, import_scene

POINTS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4")
COUNT = 4


def trees(**more: Any) -> tuple[dict[str, Any], list[np.ndarray]]:
    rng = np.random.default_rng(2)
    turns = rng.normal(size=(COUNT, 4))
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    parts = rng.normal(size=(COUNT, 3)), turns, rng.uniform(0.5, 2, (COUNT, 3))
    arrays = [POINTS, POINTS[::-1] * 0.1, *parts, np.array([0, 1]), np.array([0, 0.75])]
    instancing = {"attributes": {"TRANSLATION": 2, "ROTATION": 3, "SCALE": 4}}
    node = {"name": "Tree", "mesh": 0, "translation": [0, 5, 0], "extras": {"wood": "oak"}}
    document = {
        "extensionsUsed": ["EXT_mesh_gpu_instancing"],
        "scenes": [{"nodes": [0]}],
        "nodes": [node | {"extensions": {"EXT_mesh_gpu_instancing": instancing}}],
        "meshes": [
            {
                "primitives": [{"attributes": {"POSITION": 0}, "targets": [{"POSITION": 1}]}],
                "extras": {"targetNames": ["wind"]},
            }
        ],
        "animations": [
            {
                "name": "blow",
                "samplers": [{"input": 5, "output": 6}],
                "channels": [{"sampler": 0, "target": {"node": 0, "path": "weights"}}],
            }
        ],
    }
    return document | more, [np.ascontiguousarray(a, "<f4") for a in arrays]


def test_each_stands_where_its_numbers_say(write_glb, tmp_path: Path) -> None:
    document, arrays = trees()
    rig, (clip,), found = read_gltf(write_glb(tmp_path / "a.glb", document, arrays))
    assert [f for f in found if f.severity != "info"] == []
    assert [mesh.name for mesh in rig.meshes] == [f"Tree_{k}" for k in range(COUNT)]
    places = compose(*(a.astype(float) for a in arrays[2:5]))
    for mesh, place in zip(rig.meshes, places, strict=True):
        expected = POINTS @ place[:3, :3] + place[3, :3] + [0, 5, 0]
        np.testing.assert_allclose(mesh.points, expected, atol=1e-6)
    assert clip.weights is not None and clip.weights.names == ("wind",)
    assert rig.groups[0].name == "Tree" and dict(rig.groups[0].extras) == {"wood": "oak"}


def test_usdskel_and_the_player_agree_on_them(write_glb, tmp_path: Path, validate_gltf) -> None:
    source = write_glb(tmp_path / "a.glb", *trees(extensionsRequired=["EXT_mesh_gpu_instancing"]))
    there = import_scene(source, tmp_path / "a.usda", every_frame=True)
    back = export_scene(tmp_path / "a.usda", tmp_path / "b.glb", every_frame=True)
    for done in (there, back):
        assert done.value is not None and done.value.missing == ()
        assert done.summary["vertex_error_max_mm"] < 5e-3  # of 6 m
        assert [f for f in done.findings if f.severity != "info"] == []
    assert validate_gltf(tmp_path / "b.glb")["issues"]["numErrors"] == 0


def test_more_than_the_limit_are_announced(write_glb, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr("usdface.io.gltf.instances._MOST_INSTANCES", COUNT - 1)
    rig, _, found = read_gltf(write_glb(tmp_path / "a.glb", *trees()))
    assert len(rig.meshes) == 1
    (lost,) = (f for f in found if f.code == "EXTENSION_DROPPED")
    assert lost.message.startswith(f"{COUNT} instances of node 0")


def test_numbers_that_do_not_fit_each_other_are_refused(write_glb, tmp_path: Path) -> None:
    document, arrays = trees()
    arrays[3] = arrays[3][:2]
    with pytest.raises(InputError, match="instances of node 'Tree' have 2 times ROTATION"):
        read_gltf(write_glb(tmp_path / "a.glb", document, arrays))
