"""A glTF that holds nothing but animations moves the rig that is given as its own clips do."""

import json
import struct
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from usdface.clips import Clip, JointsTake
from usdface.errors import InputError
from usdface.findings import Finding
from usdface.io.gltf.write import write_gltf
from usdface.io.transforms import compose
from usdface.io.usd.clips import animated_rig
from usdface.io.usd.rig_write import write_rig
from usdface.io.usd.stage import open_stage
from usdface.pipeline import import_scene
from usdface.rigs import BlendShape, Inbetween, Mesh, Rig, Skeleton, Skin
from usdface.takes import WeightsTake

JOINTS = ("root", "root/neck", "root/neck/head")
TIMES = np.arange(6) / 24


def turns(rng: np.random.Generator, *shape: int) -> np.ndarray:
    values = rng.normal(size=(*shape, 4))
    return values / np.linalg.norm(values, axis=-1, keepdims=True)


def character() -> tuple[Rig, Clip]:
    rng = np.random.default_rng(8)
    points = rng.normal(size=(30, 3))
    shapes = tuple(BlendShape.from_dense(n, rng.normal(0, 0.1, (30, 3))) for n in ("jaw ü", "口"))
    held = rng.random((30, 2)) + 0.1
    skin = Skin(rng.integers(0, 3, (30, 2)), held / held.sum(axis=1, keepdims=True))
    head = Mesh("Head", points, np.full(10, 3), np.arange(30), shapes=shapes, skin=skin)
    rest = compose(rng.normal(size=(3, 3)), turns(rng, 3), np.ones((3, 3)))
    bind = compose(rng.normal(size=(3, 3)), turns(rng, 3), np.ones((3, 3)))
    names = tuple(joint.rpartition("/")[2] for joint in JOINTS)
    moves = rng.normal(size=(6, 2, 3)), turns(rng, 6, 2), np.ones((6, 2, 3))
    weights = WeightsTake(("jaw ü", "口"), TIMES, rng.uniform(size=(6, 2)), 24.0)
    clip = Clip("wink", weights, JointsTake(JOINTS[1:], TIMES, *moves, 24.0))
    return Rig("r", (head,), Skeleton(JOINTS, names, bind, rest)), clip


def without_meshes(path: Path, edit: Callable[[dict[str, Any]], None] = lambda _: None) -> Path:
    """Take meshes and skins out of a GLB; names of targets go to the nodes."""
    data = path.read_bytes()
    size = struct.unpack_from("<I", data, 12)[0]
    document, rest = json.loads(data[20 : 20 + size]), data[20 + size :]
    for node in document["nodes"]:
        if "mesh" in node:
            names = document["meshes"][node.pop("mesh")]["extras"]["targetNames"]
            node["extras"] = {"targetNames": names}
        node.pop("skin", None)
    for key in ("meshes", "skins", "materials"):
        document.pop(key, None)
    edit(document)
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sII", b"glTF", 2, 20 + len(text) + len(rest))
    path.write_bytes(head + struct.pack("<I4s", len(text), b"JSON") + text + rest)
    return path


def messages(found: tuple[Finding, ...]) -> dict[str, str]:
    return {f.code: f.message for f in found if f.severity != "info"}


def shown(baked: Any, path: Path) -> np.ndarray:
    (points,) = baked(path, 24 * TIMES).values()
    return points


def test_usdskel_shows_what_the_rigs_own_clip_shows(tmp_path: Path, baked: Any) -> None:
    rig, clip = character()
    write_rig(rig, tmp_path / "own.usdc", [clip])
    write_rig(rig, tmp_path / "rig.usdc")
    write_gltf(rig, tmp_path / "clip.glb", [clip])
    with_meshes = tmp_path / "a.usdc"
    done = import_scene(tmp_path / "clip.glb", with_meshes, rig=tmp_path / "rig.usdc")
    assert messages(done.findings) == {}
    without_meshes(tmp_path / "clip.glb")
    done = import_scene(tmp_path / "clip.glb", tmp_path / "b.usdc", rig=tmp_path / "rig.usdc")
    assert messages(done.findings) == {} and done.summary["clips"] == 1
    for path in (with_meshes, tmp_path / "b.usdc"):
        np.testing.assert_allclose(
            shown(baked, path), shown(baked, tmp_path / "own.usdc"), atol=1e-5
        )


def test_clips_come_before_the_rigs_own(tmp_path: Path) -> None:
    rig, clip = character()
    write_gltf(rig, tmp_path / "rig.glb", [clip])
    write_gltf(rig, tmp_path / "clip.glb", [clip])
    path = without_meshes(tmp_path / "clip.glb")
    import_scene(path, tmp_path / "a.usdc", rig=tmp_path / "rig.glb")
    clips = animated_rig(open_stage(tmp_path / "a.usdc"))[1]
    assert [c.name for c in clips if not c.still] == ["wink", "wink 2"]


def test_what_the_rig_lacks_is_named(tmp_path: Path) -> None:
    rig, clip = character()
    write_gltf(rig, tmp_path / "clip.glb", [clip])

    def rename(document: dict[str, Any]) -> None:
        for node in document["nodes"]:
            node["name"] = {"head": "skull"}.get(node["name"], node["name"])
            if "extras" in node:
                node["extras"]["targetNames"][0] = "chin"

    path = without_meshes(tmp_path / "clip.glb", rename)
    write_rig(rig, tmp_path / "rig.usdc")
    found = messages(import_scene(path, tmp_path / "a.usdc", rig=tmp_path / "rig.usdc").findings)
    assert set(found) == {"SHAPE_UNKNOWN", "ANIMATION_DROPPED"}
    assert "skull" in found["ANIMATION_DROPPED"]
    (kept,) = animated_rig(open_stage(tmp_path / "a.usdc"))[1]
    assert kept.weights is not None and clip.weights is not None
    np.testing.assert_allclose(kept.weights.column("口"), clip.weights.column("口"), atol=1e-6)
    assert not kept.weights.column("jaw ü").any()


def test_a_curve_moves_the_shape_of_its_name_before_one_that_had_it(tmp_path: Path) -> None:
    rig, clip = character()
    write_gltf(rig, tmp_path / "clip.glb", [clip])
    head = rig.meshes[0]
    renamed = tuple(replace(s, name=f"Twin:{s.name}", label=s.name) for s in head.shapes)
    twin = replace(head, name="Twin", shapes=renamed)
    write_rig(replace(rig, meshes=(head, twin)), tmp_path / "rig.usdc")
    import_scene(
        without_meshes(tmp_path / "clip.glb"), tmp_path / "a.usdc", rig=tmp_path / "rig.usdc"
    )
    (kept,) = animated_rig(open_stage(tmp_path / "a.usdc"))[1]
    assert kept.weights is not None and clip.weights is not None
    np.testing.assert_allclose(
        kept.weights.reordered(clip.weights.names).weights, clip.weights.weights, atol=1e-6
    )


def test_targets_without_names_are_those_of_the_rig_in_order(tmp_path: Path, baked: Any) -> None:
    rig, clip = character()
    face = rig.meshes[0]
    half = Inbetween("half", 0.5, 0.3 * face.shapes[0].offsets)
    shapes = replace(face.shapes[0], inbetweens=(half,)), face.shapes[1]
    rig = replace(rig, meshes=(replace(face, shapes=shapes),))
    write_gltf(rig, tmp_path / "clip.glb", [clip])
    path = without_meshes(
        tmp_path / "clip.glb", lambda d: [node.pop("extras", None) for node in d["nodes"]]
    )
    write_rig(rig, tmp_path / "rig.usdc")
    write_rig(rig, tmp_path / "own.usdc", [clip])
    done = import_scene(path, tmp_path / "a.usdc", rig=tmp_path / "rig.usdc")
    assert [f.values["feature"] for f in done.findings if f.severity != "info"] == ["target_order"]
    ours, theirs = (shown(baked, tmp_path / name) for name in ("a.usdc", "own.usdc"))
    np.testing.assert_allclose(ours, theirs, atol=1e-5)


def test_another_rest_pose_is_measured(tmp_path: Path) -> None:
    rig, clip = character()
    assert rig.skeleton is not None
    write_gltf(rig, tmp_path / "clip.glb", [clip])
    path = without_meshes(tmp_path / "clip.glb")
    rest = rig.skeleton.rest.copy()
    rest[1, 3, :3] += [0.003, 0, 0.004]
    write_rig(replace(rig, skeleton=replace(rig.skeleton, rest=rest)), tmp_path / "rig.usdc")
    done = import_scene(path, tmp_path / "a.usdc", rig=tmp_path / "rig.usdc")
    (found,) = (f for f in done.findings if f.severity != "info")
    assert found.values["feature"] == "rest_pose"
    assert found.values["error_mm"] == pytest.approx(5, abs=1e-3)


@pytest.mark.parametrize("part", ["animations", "names"])
def test_a_file_that_moves_nothing_of_the_rig_is_refused(tmp_path: Path, part: str) -> None:
    rig, clip = character()
    write_gltf(rig, tmp_path / "clip.glb", [clip])

    def spoil(document: dict[str, Any]) -> None:
        if part == "animations":
            del document["animations"]
        for node in document["nodes"]:
            node["name"] += "?"
            if "extras" in node:
                node["extras"]["targetNames"] = ["a", "b"]

    path = without_meshes(tmp_path / "clip.glb", spoil)
    write_rig(rig, tmp_path / "rig.usdc")
    with pytest.raises(InputError, match="no animation" if part == "animations" else "none of its"):
        import_scene(path, tmp_path / "a.usdc", rig=tmp_path / "rig.usdc")
    assert not (tmp_path / "a.usdc").exists()


def test_meshes_whose_names_were_made_unique_move_alike(tmp_path: Path) -> None:
    """Blender's USD counts through the names of head and teeth, which its glTF has in common."""
    rig, clip = character()
    write_gltf(rig, tmp_path / "clips.glb", (clip,))
    (head,) = rig.meshes
    counted = (replace(s, name=f"{s.name}2", label=s.name) for s in head.shapes[:1])
    teeth = replace(head, name="Teeth", shapes=tuple(counted))
    twice = replace(head.shapes[0], name="again", label=head.shapes[0].name)
    both = replace(rig, meshes=(replace(head, shapes=(*head.shapes, twice)), teeth))
    write_rig(both, tmp_path / "rig.usda")
    import_scene(tmp_path / "clips.glb", tmp_path / "played.usda", rig=tmp_path / "rig.usda")
    played = animated_rig(open_stage(tmp_path / "played.usda"))[1][0].weights
    assert played is not None and clip.weights is not None
    own = clip.weights.weights[:, 0]
    np.testing.assert_allclose(played.weights[:, played.names.index("jaw ü2")], own, atol=1e-6)
    np.testing.assert_allclose(played.weights[:, played.names.index("jaw ü")], own, atol=1e-6)
    assert not played.weights[:, played.names.index("again")].any()
