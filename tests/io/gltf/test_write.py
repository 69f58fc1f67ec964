"""Rigs and clips written as glTF, judged by a player and a validator of others."""

import json
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from clips import plays, read_one
from deformed import deformed
from scipy.spatial.transform import Rotation

from usdface.errors import OutputError
from usdface.geometry.triangulation import triangulated
from usdface.io.gltf.read import read_gltf
from usdface.io.gltf.write import write_gltf
from usdface.rigs import BlendShape, Mesh, Rig, Skeleton, Skin
from usdface.takes import WeightsTake


class Player:
    """A glTF player of its own: JSON and struct, column vectors, no code of the project."""

    def __init__(self, path: Path) -> None:
        data = path.read_bytes()
        size = struct.unpack_from("<I", data, 12)[0]
        self.json: dict[str, Any] = json.loads(data[20 : 20 + size])
        self.blob = data[28 + size :]

    def raw(self, view: int, offset: int, dtype: str, shape: tuple[int, int]) -> np.ndarray:
        start = self.json["bufferViews"][view].get("byteOffset", 0) + offset
        flat = np.frombuffer(self.blob, dtype, shape[0] * shape[1], start)
        return flat.reshape(shape)

    def accessor(self, index: int) -> np.ndarray:
        a = self.json["accessors"][index]
        dtypes = {5121: "<u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
        width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}[a["type"]]
        dtype = dtypes[a["componentType"]]
        values = np.zeros((a["count"], width), dtype)
        if "bufferView" in a:
            values[:] = self.raw(a["bufferView"], a.get("byteOffset", 0), dtype, values.shape)
        if "sparse" in a:
            s = a["sparse"]
            kind = dtypes[s["indices"]["componentType"]]
            rows = self.raw(s["indices"]["bufferView"], 0, kind, (s["count"], 1))[:, 0]
            values[rows] = self.raw(s["values"]["bufferView"], 0, dtype, (s["count"], width))
        return values

    def weights(self, node: int, time: float) -> np.ndarray:
        mesh = self.json["meshes"][self.json["nodes"][node]["mesh"]]
        for animation in self.json.get("animations", []):
            for channel in animation["channels"]:
                if channel["target"] == {"node": node, "path": "weights"}:
                    sampler = animation["samplers"][channel["sampler"]]
                    times = self.accessor(sampler["input"])[:, 0]
                    values = self.accessor(sampler["output"]).reshape(len(times), -1)
                    return np.array([np.interp(time, times, column) for column in values.T])
        return np.array(mesh.get("weights", []))

    def world(self, node: int) -> np.ndarray:
        n = self.json["nodes"][node]
        local = np.eye(4)
        turn = Rotation.from_quat(n.get("rotation", [0, 0, 0, 1])).as_matrix()
        local[:3, :3] = turn @ np.diag(n.get("scale", [1, 1, 1]))
        local[:3, 3] = n.get("translation", [0, 0, 0])
        for parent, other in enumerate(self.json["nodes"]):
            if node in other.get("children", []):
                return self.world(parent) @ local
        return local

    def corners(self, node: int, weights: np.ndarray) -> list[np.ndarray]:
        """Positions (T, 3, 3) of the triangles of each primitive."""
        n = self.json["nodes"][node]
        result = []
        for primitive in self.json["meshes"][n["mesh"]]["primitives"]:
            at = primitive["attributes"]
            points = self.accessor(at["POSITION"]).astype(float)
            for weight, target in zip(weights, primitive.get("targets", []), strict=True):
                points += weight * self.accessor(target["POSITION"])
            if "skin" in n:
                skin = self.json["skins"][n["skin"]]
                inverse = self.accessor(skin["inverseBindMatrices"]).reshape(-1, 4, 4)
                moves = [self.world(joint) @ inverse[k].T for k, joint in enumerate(skin["joints"])]
                chosen = np.stack(moves)[self.accessor(at["JOINTS_0"])]
                blend = np.einsum("vk,vkij->vij", self.accessor(at["WEIGHTS_0"]), chosen)
                points = np.einsum("vij,vj->vi", blend, np.c_[points, np.ones(len(points))])
                points = points[:, :3]
            triangles = self.accessor(primitive["indices"])[:, 0].reshape(-1, 3)
            result.append(points[triangles])
        return result


def expected_corners(mesh: Mesh, points: np.ndarray) -> np.ndarray:
    """Fans of the faces in the order of the subsets, then of the faces in none."""
    corners, faces = triangulated(mesh.face_counts, mesh.face_indices, mesh.points)
    listed = [subset.faces for subset in mesh.subsets]
    rest = np.setdiff1d(np.arange(len(mesh.face_counts)), np.concatenate([[], *listed]))
    rows = [np.flatnonzero(np.isin(faces, part)) for part in (*listed, rest)]
    return points[mesh.face_indices[corners[np.concatenate(rows)]]]


def take_for(rig: Rig, seed: int = 0) -> WeightsTake:
    rng = np.random.default_rng(seed)
    names = tuple(rng.permutation(rig.shape_names).tolist())
    return WeightsTake(names, np.arange(50) / 60, rng.uniform(-1, 2, (50, len(names))), 60.0)


@pytest.fixture
def plain_rig(face_rig: Rig) -> Rig:
    """`face_rig` without inbetweens."""

    def plain(mesh: Mesh) -> Mesh:
        return replace(mesh, shapes=tuple(replace(s, inbetweens=()) for s in mesh.shapes))

    return replace(face_rig, meshes=tuple(map(plain, face_rig.meshes)))


def test_another_player_shows_what_the_rig_shows(tmp_path: Path, plain_rig: Rig) -> None:
    take = take_for(plain_rig)
    path = tmp_path / "a.glb"
    write_gltf(plain_rig, path, plays(take))
    player = Player(path)
    for node, mesh in enumerate(plain_rig.meshes):
        for frame in (0, 7, 49):
            weights = take.reordered(mesh.shape_names).weights[frame]
            shown = np.concatenate(player.corners(node, player.weights(node, take.times[frame])))
            expected = expected_corners(mesh, deformed(mesh, weights))
            np.testing.assert_allclose(shown, expected, atol=1e-7)


def test_another_player_skins_as_the_rig_does(tmp_path: Path, skinned_rig: Rig) -> None:
    skeleton = skinned_rig.skeleton
    assert skeleton is not None
    bent = skeleton.rest.copy()
    bent[1, :3, :3] = Rotation.from_euler("xyz", [20, 30, 40], degrees=True).as_matrix()
    rig = replace(skinned_rig, skeleton=replace(skeleton, rest=bent))
    path = tmp_path / "a.glb"
    write_gltf(rig, path)
    mesh = rig.meshes[0]
    assert mesh.skin is not None
    moves = np.linalg.inv(skeleton.bind) @ np.stack([bent[0], bent[1] @ bent[0]])
    points = np.c_[mesh.points, np.ones(len(mesh.points))]
    chosen = moves[mesh.skin.joints]
    points = np.einsum("vk,vi,vkij->vj", mesh.skin.weights, points, chosen)[:, :3]
    player = Player(path)
    shown = np.concatenate(player.corners(0, player.weights(0, 0.0)))
    np.testing.assert_allclose(shown, expected_corners(mesh, points), atol=1e-6)


@pytest.mark.parametrize("suffix", [".glb", ".gltf"])
def test_round_trip(tmp_path: Path, plain_rig: Rig, suffix: str) -> None:
    take = take_for(plain_rig)
    path = tmp_path / f"face{suffix}"
    write_gltf(plain_rig, path, plays(take))
    rig, same, found = read_one(path)
    assert found == []
    assert rig.name == plain_rig.name
    assert rig.materials == plain_rig.materials
    assert same is not None
    assert same.rate == 60.0
    assert set(same.names) == set(take.names)
    np.testing.assert_allclose(same.times, take.times, atol=1e-7)
    np.testing.assert_allclose(same.reordered(take.names).weights, take.weights, atol=1e-6)
    for before, after in zip(plain_rig.meshes, rig.meshes, strict=True):
        assert (before.name, before.shape_names) == (after.name, after.shape_names)
        np.testing.assert_array_equal(before.points.astype(np.float32), after.points)
        assert [s.material for s in before.subsets] == [s.material for s in after.subsets]
        for one, two in zip(before.shapes, after.shapes, strict=True):
            moved = two.offsets.any(axis=1)  # the others only turn their normals
            np.testing.assert_array_equal(one.indices, two.indices[moved])
            np.testing.assert_array_equal(one.offsets.astype(np.float32), two.offsets[moved])


def test_the_second_round_trip_changes_nothing(tmp_path: Path, skinned_rig: Rig) -> None:
    write_gltf(skinned_rig, tmp_path / "1.glb", plays(take_for(skinned_rig)))
    rig, take, _ = read_one(tmp_path / "1.glb")
    assert take is not None
    assert rig.skeleton is not None
    assert skinned_rig.skeleton is not None
    assert rig.skeleton.joints == ("neck", "neck/Head_Joint")
    assert rig.skeleton.names == skinned_rig.skeleton.names
    np.testing.assert_allclose(rig.skeleton.bind, skinned_rig.skeleton.bind, atol=1e-6)
    np.testing.assert_allclose(rig.skeleton.rest, skinned_rig.skeleton.rest, atol=1e-6)
    write_gltf(rig, tmp_path / "2.glb", plays(take))
    again, same, _ = read_one(tmp_path / "2.glb")
    assert same is not None
    np.testing.assert_allclose(take.weights, same.weights, atol=2e-7)  # through inbetweens
    np.testing.assert_array_equal(take.times, same.times)
    for one, two in zip(rig.meshes[0].shapes, again.meshes[0].shapes, strict=True):
        np.testing.assert_array_equal(one.indices, two.indices)
        np.testing.assert_allclose(one.normal_offsets, two.normal_offsets, atol=1e-6)


@pytest.mark.parametrize("suffix", [".glb", ".gltf"])
def test_the_khronos_validator_finds_nothing(
    tmp_path: Path, face_rig: Rig, skinned_rig: Rig, validate_gltf, suffix: str
) -> None:
    for rig in (face_rig, skinned_rig):
        path = tmp_path / f"{rig.name}{suffix}"
        write_gltf(rig, path, plays(take_for(rig)))
        report = validate_gltf(path)
        severe = [m for m in report["issues"]["messages"] if m["severity"] < 2]
        assert severe == []
        assert report["info"]["hasMorphTargets"]


def test_equal_input_gives_equal_bytes(tmp_path: Path, skinned_rig: Rig) -> None:
    for name in ("a", "b"):
        write_gltf(skinned_rig, tmp_path / name / "x.glb", plays(take_for(skinned_rig)))
    assert (tmp_path / "a/x.glb").read_bytes() == (tmp_path / "b/x.glb").read_bytes()


def test_columns_travel_by_name(tmp_path: Path, plain_rig: Rig) -> None:
    times = [0.0, 1.0]
    take = WeightsTake(("not there", "口", "jawOpen"), times, [[9, 0.1, 0.2], [9, 0.3, 0.4]])
    found = write_gltf(plain_rig, tmp_path / "a.glb", plays(take))
    assert ("SHAPE_UNKNOWN", "not there") in [(f.code, f.where) for f in found]
    player = Player(tmp_path / "a.glb")
    np.testing.assert_allclose(player.weights(0, 1.0), [0.4, 0, 0, 0.3], atol=1e-7)
    np.testing.assert_allclose(player.weights(1, 0.0), [0.2], atol=1e-7)
    inputs = {s["input"] for s in player.json["animations"][0]["samplers"]}
    assert len(inputs) == 1  # one clock for all meshes


def test_a_mesh_that_the_take_does_not_name_is_not_animated(tmp_path: Path, plain_rig: Rig) -> None:
    write_gltf(plain_rig, tmp_path / "a.glb", plays(WeightsTake(("口",), [0.0], [[1.0]])))
    channels = Player(tmp_path / "a.glb").json["animations"][0]["channels"]
    assert [channel["target"]["node"] for channel in channels] == [0]
    write_gltf(plain_rig, tmp_path / "b.glb", plays(WeightsTake(("?",), [0.0], [[1.0]])))
    assert "animations" not in Player(tmp_path / "b.glb").json


@pytest.mark.parametrize(
    "times",
    [
        [-0.5, 0.0, 0.5],
        [0.0, 1e-60, 1e-50, 1.0],
        [3600.0, 3600.00001, 3600.00002, 3600.1],
        [1e6, 1e6 + 1 / 240, 1e6 + 2 / 240],
    ],
)
def test_times_are_what_gltf_wants(tmp_path: Path, plain_rig: Rig, times: list[float]) -> None:
    take = WeightsTake(("jawOpen",), times, np.arange(len(times))[:, None])
    found = write_gltf(plain_rig, tmp_path / "a.glb", plays(take))
    player = Player(tmp_path / "a.glb")
    index = player.json["animations"][0]["samplers"][0]["input"]
    clock = player.accessor(index)[:, 0]
    assert clock[0] >= 0
    assert (np.diff(clock) > 0).all()
    shift = max(0, -times[0])
    assert np.abs(clock - np.array(times) - shift).max() <= 4 * np.spacing(clock[-1])
    assert (shift > 0) == any(f.code == "FEATURE_DROPPED" for f in found)
    assert player.json["accessors"][index]["min"] == [clock[0]]
    assert player.json["accessors"][index]["max"] == [clock[-1]]


def test_steps_survive_the_round_trip(tmp_path: Path, plain_rig: Rig) -> None:
    jump = float(np.nextafter(np.float32(1), np.float32(0)))
    take = WeightsTake(("jawOpen",), [0.0, jump, 1.0, 2.0], [[0.0], [0], [1], [1]])
    write_gltf(plain_rig, tmp_path / "a.glb", plays(take))
    same = read_one(tmp_path / "a.glb")[1]
    assert same is not None
    np.testing.assert_array_equal(same.times, take.times)


def test_shapes_that_move_nothing_stay_in_place(tmp_path: Path, validate_gltf) -> None:
    shapes = (BlendShape("none", [], np.zeros((0, 3))), BlendShape("all", [1], [[0, 0, 1.0]]))
    rig = Rig("r", (Mesh("m", np.eye(3), [3], [0, 1, 2], shapes=shapes),))
    write_gltf(rig, tmp_path / "a.glb")
    assert validate_gltf(tmp_path / "a.glb")["issues"]["numErrors"] == 0
    assert read_gltf(tmp_path / "a.glb")[0].shape_names == ("none", "all")


def one_joint(rest: np.ndarray) -> Rig:
    mesh = Mesh("m", np.eye(3), [3], [0, 1, 2], skin=Skin(np.zeros((3, 1)), np.ones((3, 1))))
    return Rig("r", (mesh,), Skeleton(("root",), ("root",), np.eye(4)[None], rest[None]))


def test_a_single_joint_is_written_where_it_moves_something(tmp_path: Path) -> None:
    moved = np.eye(4)
    moved[3, 0] = 0.1
    write_gltf(one_joint(np.eye(4)), tmp_path / "still.glb")
    write_gltf(one_joint(moved), tmp_path / "moved.glb")
    assert "skins" not in Player(tmp_path / "still.glb").json
    shown = Player(tmp_path / "moved.glb").corners(0, np.zeros(0))[0]
    np.testing.assert_allclose(shown[0], np.eye(3) + np.array([0.1, 0, 0]), atol=1e-7)


def test_a_failure_leaves_what_was_there(tmp_path: Path) -> None:
    path = tmp_path / "a.glb"
    path.write_bytes(b"before")
    rig = Rig("r", (Mesh("m", 1e300 * np.eye(3), [3], [0, 1, 2]),))
    with pytest.raises(OutputError):
        write_gltf(rig, path)
    assert path.read_bytes() == b"before"
    assert [p.name for p in tmp_path.iterdir()] == ["a.glb"]


def test_an_empty_rig_is_still_gltf(tmp_path: Path, validate_gltf) -> None:
    write_gltf(Rig("nothing", ()), tmp_path / "a.glb")
    assert validate_gltf(tmp_path / "a.glb")["issues"]["numErrors"] == 0
