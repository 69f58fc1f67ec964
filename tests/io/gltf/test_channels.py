import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from clips import evaluate_gltf, plays, read_one

from usdface.errors import InputError
from usdface.io.gltf.read import read_gltf
from usdface.io.gltf.write import write_gltf
from usdface.options import ExportOptions
from usdface.rigs import Rig
from usdface.takes import WeightsTake

POINTS = np.eye(3, dtype="<f4")
TIMES = np.array([0, 1, 2], "<f4")
OTHERS = np.array([0.5, 1.5], "<f4")
ALL = np.array([[0, 1], [1, 0], [0, 0]], "<f4").ravel()
ONE = np.array([0.25, 0.75], "<f4")
UP = np.array([[0, 0, 0], [0, 1, 0]], "<f4")


def pointer(path: str, sampler: int) -> dict[str, Any]:
    return {
        "sampler": sampler,
        "target": {"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": path}}},
    }


def document(*channels: dict[str, Any]) -> dict[str, Any]:
    primitive = {"attributes": {"POSITION": 0}, "targets": [{"POSITION": 1}] * 2}
    samplers = [{"input": 2, "output": 4}, {"input": 3, "output": 5}, {"input": 3, "output": 6}]
    return {
        "extensionsUsed": ["KHR_animation_pointer"],
        "meshes": [{"primitives": [primitive], "extras": {"targetNames": ["a", "b"]}}],
        "nodes": [{"mesh": 0, "name": "n"}, {"mesh": 0, "name": "own", "weights": [0.5, 0.5]}],
        "scenes": [{"nodes": [0, 1]}],
        "animations": [{"name": "clip", "samplers": samplers, "channels": list(channels)}],
    }


ARRAYS = [POINTS, POINTS, TIMES, OTHERS, ALL, ONE, UP]


def channels_at(path: Path, times: list[float]) -> np.ndarray:
    """The weights of the first mesh, as our reader and our evaluator see them."""
    take = read_one(path)[1]
    assert take is not None
    mine = [np.interp(times, take.times, take.column(name)) for name in ("a", "b")]
    judge = evaluate_gltf(path)[0].weights_at(np.array(times))
    np.testing.assert_allclose(np.stack(mine, 1), judge, atol=1e-7)
    return judge


@pytest.mark.parametrize("path", ["/nodes/0/weights", "/meshes/0/weights"])
def test_a_pointer_to_all_weights(write_glb, tmp_path: Path, path: str) -> None:
    glb = write_glb(tmp_path / "a.glb", document(pointer(path, 0)), ARRAYS)
    seen = channels_at(glb, [0, 0.5, 2])
    np.testing.assert_allclose(seen, [[0, 1], [0.5, 0.5], [0, 0]])
    rig, _, _ = read_gltf(glb)  # the node with weights of its own does not follow the mesh
    assert rig.meshes[1].shape_names == ("own:a", "own:b")
    assert [shape.label for shape in rig.meshes[1].shapes] == ["a", "b"]


def test_a_pointer_to_one_weight_goes_over_the_core(write_glb, tmp_path: Path) -> None:
    core = {"sampler": 0, "target": {"node": 0, "path": "weights"}}
    one = pointer("/nodes/0/weights/1", 1)
    times = [0, 0.5, 1, 1.5, 2]
    alone = channels_at(write_glb(tmp_path / "a.glb", document(one), ARRAYS), times)
    np.testing.assert_allclose(alone, np.stack([[0] * 5, [0.25, 0.25, 0.5, 0.75, 0.75]], 1))
    for number, channels in enumerate(([core, one], [one, core])):
        glb = write_glb(tmp_path / f"{number}.glb", document(*channels), ARRAYS)
        both = channels_at(glb, times)
        np.testing.assert_allclose(both[:, 0], [0, 0.5, 1, 0.5, 0])
        np.testing.assert_allclose(both[:, 1], alone[:, 1])


def test_a_pointer_to_a_transform(write_glb, tmp_path: Path) -> None:
    glb = write_glb(tmp_path / "a.glb", document(pointer("/nodes/0/translation", 2)), ARRAYS)
    rig, (clip, _), found = read_gltf(glb)
    assert {f.code for f in found} == {"NAME_CHANGED"}
    assert rig.skeleton is not None and clip.joints is not None
    assert rig.skeleton.joints == ("n",)
    np.testing.assert_array_equal(clip.joints.translations[:, 0], UP)


@pytest.mark.parametrize(
    "path", ["/materials/0/pbrMetallicRoughness/baseColorFactor", "/nodes/0", "", "/nodes/0/x"]
)
def test_pointers_to_other_things_are_announced(write_glb, tmp_path: Path, path: str) -> None:
    _, clips, found = read_gltf(write_glb(tmp_path / "a.glb", document(pointer(path, 1)), ARRAYS))
    assert [clip.name for clip in clips] == [""]  # the weights that stand still
    assert [f.code for f in found if f.severity == "warning"] == ["ANIMATION_DROPPED"]


@pytest.mark.parametrize(
    "channels",
    [
        [pointer("/nodes/9/weights", 0)],
        [pointer("/meshes/9/weights", 0)],
        [pointer("/nodes/0/weights/2", 1)],
        [pointer("/nodes/0/weights", 1)],
        [pointer("/nodes/0/weights/0", 9)],
        [pointer("/nodes/0/weights/0", 1)] * 2,
        [{"sampler": 0, "target": {"path": "pointer"}}],
        [{"sampler": 0, "target": {"path": "weights", "node": 7}}],
    ],
)
def test_wrong_targets_are_refused(write_glb, tmp_path: Path, channels) -> None:
    with pytest.raises(InputError):
        read_gltf(write_glb(tmp_path / "a.glb", document(*channels), ARRAYS))


def test_the_export_has_a_core_for_those_without(tmp_path: Path, face_rig: Rig) -> None:
    times = np.arange(12) / 30
    rng = np.random.default_rng(3)
    weights = rng.normal(size=(12, len(face_rig.shape_names)))
    weights[:, 0], weights[3:9, 1] = 0.5, 0.25  # that stands still, that rests
    clips = plays(WeightsTake(face_rig.shape_names, times, weights, 30.0))
    write_gltf(face_rig, tmp_path / "plain.gltf", clips)
    write_gltf(face_rig, tmp_path / "both.gltf", clips, ExportOptions(pointer=True))
    both = json.loads((tmp_path / "both.gltf").read_text())
    assert both["extensionsUsed"] == ["KHR_animation_pointer"]
    assert not both.get("extensionsRequired")
    animation = both["animations"][0]
    core = [c for c in animation["channels"] if c["target"]["path"] == "weights"]
    single = [c for c in animation["channels"] if c["target"]["path"] == "pointer"]
    assert len(core) == len(face_rig.meshes)
    assert len(single) == sum(len(mesh["weights"]) for mesh in both["meshes"])
    keys = [
        both["accessors"][animation["samplers"][c["sampler"]]["input"]]["count"] for c in single
    ]
    assert min(keys) == 1 and max(keys) >= 12
    moments = np.linspace(0, 0.4, 97)
    pairs = [evaluate_gltf(tmp_path / f"{name}.gltf") for name in ("plain", "both")]
    for one, other in zip(*pairs, strict=True):
        np.testing.assert_array_equal(one.weights_at(moments), other.weights_at(moments))
    take = read_one(tmp_path / "both.gltf")[1]
    assert take is not None
    np.testing.assert_allclose(take.times, times, atol=1e-7)
    same = take.reordered(face_rig.shape_names).weights
    np.testing.assert_allclose(same, weights, atol=1e-6)
