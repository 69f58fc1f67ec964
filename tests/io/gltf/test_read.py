import base64
import json
import struct
from pathlib import Path

import numpy as np
import pytest
from clips import plays, read_one
from deformed import deformed

from usdface.clips import Clip
from usdface.errors import InputError
from usdface.io.gltf.image import to_png
from usdface.io.gltf.read import read_gltf
from usdface.io.gltf.write import write_gltf
from usdface.io.transforms import compose
from usdface.io.usd.clips import animated_rig
from usdface.io.usd.rig import read_rig
from usdface.io.usd.rig_write import write_rig
from usdface.io.usd.stage import open_stage
from usdface.rigs import Rig
from usdface.takes import WeightsTake

TRIANGLE = np.eye(3, dtype="<f4")


def take_for(rig: Rig) -> WeightsTake:
    rng = np.random.default_rng(10)
    names = rig.shape_names
    return WeightsTake(names, np.arange(20) / 24, rng.uniform(-1, 2, (20, len(names))), 24.0)


def test_only_the_default_scene_is_read(write_glb, tmp_path: Path) -> None:
    document = {
        "scene": 1,
        "scenes": [{"nodes": [0]}, {"nodes": [1], "name": "seen"}],
        "nodes": [{"mesh": 0, "name": "a"}, {"mesh": 0, "name": "b", "translation": [1, 0, 0]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
    }
    rig, take, found = read_one(write_glb(tmp_path / "x.glb", document, [TRIANGLE]))
    assert (rig.name, rig.source, take) == ("seen", "x.glb", None)
    (lost,) = [f.message for f in found if f.code == "FEATURE_DROPPED"]
    assert lost == "1 node is not in the default scene, and left out: a"
    assert [mesh.name for mesh in rig.meshes] == ["b"]
    np.testing.assert_array_equal(rig.meshes[0].points, TRIANGLE + np.array([1, 0, 0]))


def test_names_of_nodes_and_of_their_meshes_come_back(write_glb, tmp_path: Path) -> None:
    """As Blender writes an object and its data."""
    mesh = {"primitives": [{"attributes": {"POSITION": 0}}]}
    document = {
        "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"mesh": 0, "name": "Head"}, {"mesh": 1, "name": "Eye"}],
        "meshes": [mesh | {"name": "Head.001"}, mesh | {"name": "Eye"}],
    }
    rig, _, _ = read_gltf(write_glb(tmp_path / "x.glb", document, [TRIANGLE]))
    assert [one.content_name for one in rig.meshes] == ["Head.001", ""]
    write_rig(rig, tmp_path / "x.usda")
    rig, _ = read_rig(tmp_path / "x.usda")
    write_gltf(rig, tmp_path / "y.gltf")
    written = json.loads((tmp_path / "y.gltf").read_text())
    assert [one["name"] for one in written["nodes"]] == ["Head", "Eye"]
    assert [one["name"] for one in written["meshes"]] == ["Head.001", "Eye"]


def test_names_of_what_nodes_and_materials_have_come_back(write_glb, tmp_path: Path) -> None:
    pixel = base64.b64encode(to_png(np.zeros((1, 1, 3), np.uint8))).decode()
    skinned = {"POSITION": 0, "JOINTS_0": 1, "WEIGHTS_0": 2}
    light = {"type": "point", "name": "Area.001"}
    document = {
        "scenes": [{"nodes": [0, 1, 2, 3]}],
        "nodes": [
            {"mesh": 0, "skin": 0, "name": "Head"},
            {"name": "neck"},
            {"camera": 0, "name": "Shot"},
            {"name": "Key", "extensions": {"KHR_lights_punctual": {"light": 0}}},
        ],
        "meshes": [{"primitives": [{"attributes": skinned, "material": 0}]}],
        "skins": [{"joints": [1], "name": "Armature"}],
        "cameras": [
            {"type": "perspective", "name": "Lens", "perspective": {"yfov": 1, "znear": 0.1}}
        ],
        "extensions": {"KHR_lights_punctual": {"lights": [light]}},
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0, "name": "Pores"}],
        "images": [{"uri": f"data:image/png;base64,{pixel}", "name": "skin 4K"}],
        "animations": [turn_of(1)],
    }
    joints, weights = np.zeros((3, 4), "u1"), np.eye(4, dtype="<f4")[[0, 0, 0]]
    arrays = [TRIANGLE, joints, weights, np.arange(2, dtype="<f4"), np.eye(4, dtype="<f4")[2:]]
    rig, clips, _ = read_gltf(write_glb(tmp_path / "x.glb", document, arrays))
    write_rig(rig, tmp_path / "x.usda", clips)
    rig, clips, _ = animated_rig(open_stage(tmp_path / "x.usda"))
    write_gltf(rig, tmp_path / "y.gltf", clips)
    written = json.loads((tmp_path / "y.gltf").read_text())
    kinds = ("skins", "cameras", "textures", "images")
    assert [written[kind][0]["name"] for kind in kinds] == ["Armature", "Lens", "Pores", "skin 4K"]
    assert written["extensions"]["KHR_lights_punctual"]["lights"][0]["name"] == "Area.001"
    assert {"Head", "Shot", "Key"} <= {one.get("name") for one in written["nodes"]}


def turn_of(node: int) -> dict:
    return {
        "channels": [{"sampler": 0, "target": {"node": node, "path": "rotation"}}],
        "samplers": [{"input": 3, "output": 4}],
    }


def test_a_mesh_may_be_used_by_several_nodes(write_glb, tmp_path: Path) -> None:
    document = {
        "nodes": [{"mesh": 0, "name": "a"}, {"mesh": 0, "name": "a", "scale": [2, 2, 2]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "targets": [{"POSITION": 0}]}]}],
    }
    rig, _, found = read_gltf(write_glb(tmp_path / "x.glb", document, [TRIANGLE]))
    assert [mesh.name for mesh in rig.meshes] == ["a", "a"]
    assert [f.code for f in found] == ["SHAPE_NAMES_ASSUMED", "PIVOTS_DROPPED"]
    assert rig.shape_names == ("target_0",)
    np.testing.assert_array_equal(rig.meshes[1].points, 2 * TRIANGLE)
    np.testing.assert_array_equal(rig.meshes[1].shapes[0].offsets, 2 * TRIANGLE)


def test_material_names_are_made_unique(write_glb, tmp_path: Path) -> None:
    document = {
        "materials": [{"name": "m"}, {"name": "m"}, {}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
    }
    triangle = np.eye(3, dtype="<f4")
    rig, _, _ = read_gltf(write_glb(tmp_path / "x.glb", document, [triangle]))
    assert [material.name for material in rig.materials] == ["m", "m_2", "Material"]


@pytest.mark.parametrize(
    ("part", "count"),
    [({"targets": [{"POSITION": 0}] * 100}, 1), ({"indices": 0}, 100), ({}, 100)],
)
def test_a_small_file_cannot_unfold_into_a_huge_scene(
    write_glb, tmp_path: Path, part, count: int
) -> None:
    points = np.zeros((30_000, 3), "<f4")
    primitive = {"attributes": {"POSITION": 0}} | part
    document = {
        "nodes": [{"mesh": 0}] * 100,
        "meshes": [{"primitives": [primitive] * count}],
    }
    with pytest.raises(InputError, match="unfolds"):
        read_gltf(write_glb(tmp_path / "x.glb", document, [points]))


def test_errors_name_the_file(tmp_path: Path) -> None:
    path = tmp_path / "face.glb"
    path.write_bytes(b"no glTF at all")
    with pytest.raises(InputError, match=r"face\.glb: not glTF, or its JSON is malformed") as error:
        read_gltf(path)
    assert "\n" not in str(error.value)


def test_damaged_files_are_read_or_refused(tmp_path: Path, skinned_rig: Rig) -> None:
    path = tmp_path / "a.glb"
    write_gltf(skinned_rig, path, plays(take_for(skinned_rig)))
    whole = path.read_bytes()
    rng = np.random.default_rng(11)
    refused = 0
    for _ in range(150):
        damaged = bytearray(whole)
        for place in rng.integers(0, len(whole), 3):
            damaged[place] = rng.integers(0, 256)
        path.write_bytes(damaged)
        try:
            read_gltf(path)
        except InputError:
            refused += 1
    assert 0 < refused <= 150


def test_wrong_json_types_are_refused_in_one_line(tmp_path: Path, skinned_rig: Rig) -> None:
    path = tmp_path / "a.gltf"
    write_gltf(skinned_rig, path, plays(take_for(skinned_rig)))
    document = json.loads(path.read_text())
    places: list[tuple[object, ...]] = []

    def walk(value: object, place: tuple[object, ...]) -> None:
        places.append(place)
        items = value.items() if isinstance(value, dict) else ()
        items = enumerate(value) if isinstance(value, list) else items
        for key, child in items:
            if key != "extras":
                walk(child, (*place, key))

    walk(document, ())
    rng = np.random.default_rng(12)
    junk = [None, -1, 10**12, 1.5, "x", [], {}, [None], {"a": 1}, True, [[]]]
    refused = 0
    for number in rng.permutation(len(places) - 1)[:120] + 1:
        changed = json.loads(path.read_text())
        owner = changed
        for key in places[number][:-1]:
            owner = owner[key]
        owner[places[number][-1]] = junk[rng.integers(len(junk))]
        bad = tmp_path / "bad.gltf"
        bad.write_text(json.dumps(changed))
        try:
            read_gltf(bad)
        except InputError as error:
            refused += 1
            assert "\n" not in str(error)
    assert refused > 30


def assert_equal_clips(one: Clip, other: Clip) -> None:
    """Keys of one joint may lie on the line of others and be gone; what moves stays."""
    if one.weights is not None:
        assert other.weights is not None
        np.testing.assert_allclose(other.weights.times, one.weights.times, atol=1e-6)
        same = other.weights.reordered(one.weights.names)
        np.testing.assert_allclose(same.weights, one.weights.weights, atol=1e-6)
    if one.joints is not None and other.joints is not None:
        kept = [one.joints.joints.index(joint) for joint in other.joints.joints]
        np.testing.assert_allclose(other.joints.times, one.joints.times, atol=1e-6)
        mine = compose(one.joints.translations, one.joints.rotations, one.joints.scales)
        its = compose(other.joints.translations, other.joints.rotations, other.joints.scales)
        np.testing.assert_allclose(its, mine[:, kept], atol=1e-5)


def real_files(shared_data: Path) -> list[Path]:
    found = [*shared_data.glob("gltf_morph/*/glTF/*.gltf"), *shared_data.glob("robot*/*.glb")]
    assert len(found) == 6
    return sorted(found)


@pytest.mark.slow
def test_real_files_survive_being_rewritten(
    shared_data: Path, tmp_path: Path, validate_gltf
) -> None:
    for path in real_files(shared_data):
        rig, clips, _ = read_gltf(path)
        assert rig.shape_names
        assert clips
        copy = tmp_path / f"{path.stem}.glb"
        write_gltf(rig, copy, clips)
        report = validate_gltf(copy)["issues"]
        assert (report["numErrors"], report["numWarnings"]) == (0, 0), path.name
        again, others, _ = read_gltf(copy)
        assert again.shape_names == rig.shape_names
        assert [clip.name for clip in others] == [clip.name for clip in clips]
        for clip, other in zip(clips, others, strict=True):
            assert_equal_clips(clip, other)
        assert len(again.meshes) == len(rig.meshes)
        for before, after in zip(rig.meshes, again.meshes, strict=True):
            size = np.abs(before.points).max()
            weights = np.linspace(-0.5, 1.5, len(before.shapes))
            # by corners: points that meet in float32 are welded
            one = deformed(before, weights)[before.face_indices]
            two = deformed(after, weights)[after.face_indices]
            np.testing.assert_allclose(one, two, atol=2e-6 * size)


def test_the_robot_is_a_whole(shared_data: Path) -> None:
    rig, clips, found = read_gltf(shared_data / "robotexpressive" / "RobotExpressive.glb")
    assert rig.shape_names == ("Angry", "Surprised", "Sad")
    assert len(clips) == 14
    assert all(clip.weights is not None and clip.joints is not None for clip in clips)
    assert {clip.rate for clip in clips} == {24.0}
    assert rig.skeleton is not None
    assert len(rig.skeleton.joints) == 43
    assert [f.code for f in found] == ["PIVOTS_DROPPED"]
    assert [group.name for group in rig.groups]  # its armature
    points = np.concatenate([mesh.points for mesh in rig.meshes])
    head = np.concatenate([m.points for m in rig.meshes if m.name.startswith("Head")])
    assert 1 < np.ptp(points[:, 1]) < 10  # metres
    assert head[:, 1].min() > np.median(points[:, 1])
    assert all(mesh.skin is not None for mesh in rig.meshes)


def test_the_validators_bad_files_are_read_or_refused(shared_data: Path) -> None:
    paths = sorted(shared_data.glob("gltf_validator_morph/*.gltf"))
    assert len(paths) == 17
    for path in paths:
        try:
            read_gltf(path)
        except InputError as error:
            assert "\n" not in str(error)


def test_a_stray_chunk_and_padding_are_ignored(write_glb, tmp_path: Path) -> None:
    document = {
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
    }
    path = write_glb(tmp_path / "x.glb", document, [TRIANGLE])
    data = path.read_bytes() + struct.pack("<I4s", 4, b"MINE") + b"abcd"
    path.write_bytes(data[:8] + struct.pack("<I", len(data)) + data[12:])
    assert len(read_gltf(path)[0].meshes) == 1
