import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from clips import evaluate_gltf, plays, read_one
from deformed import deformed

from usdface.io.gltf.inbetweens import (
    Step,
    crossings,
    flat_mesh,
    flat_weights,
    folded,
    steps_in,
)
from usdface.io.gltf.read import read_gltf
from usdface.io.gltf.write import write_gltf
from usdface.pipeline import export_scene
from usdface.rigs import BlendShape, Inbetween, Mesh, Rig
from usdface.takes import WeightsTake


def curved(*places: float, name: str = "s") -> Mesh:
    rng = np.random.default_rng(len(places))
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    between = tuple(Inbetween(f"at {p}", p, rng.normal(size=(2, 3))) for p in places)
    shape = BlendShape(name, [0, 2], rng.normal(size=(2, 3)), None, between)
    return Mesh("m", points, [3], [0, 1, 2], shapes=(shape,))


@pytest.mark.parametrize("places", [(), (0.5,), (-0.4, 0.3, 0.6), (1.5,), (-0.5, -0.1), (2, 1.2)])
def test_flat_targets_are_the_line_through_the_inbetweens(posed, places) -> None:
    mesh = curved(*places)
    flat, notes, found = flat_mesh(mesh)
    assert found == [] and len(notes) == len(places)
    weights = np.linspace(-2, 3, 101)[:, None]
    for weight, row in zip(weights, flat_weights(mesh, weights), strict=True):
        np.testing.assert_allclose(deformed(flat, row), posed(mesh, weight), atol=1e-12)


def test_flat_weights_are_linear_between_crossings() -> None:
    mesh = curved(-0.4, 0.3, 0.6, 1.5)
    times, curve = np.array([0.0, 1.0, 2.0]), np.array([[-1.0], [2.0], [0.3]])
    keys = np.unique([*times, *crossings(mesh, times, curve)])
    np.testing.assert_allclose(  # neither the outer places nor one that is only touched
        keys, [0, 1 / 3, 1.3 / 3, 1.6 / 3, 2 / 3, 1, 1 + 1 / 1.7, 1 + 1.4 / 1.7, 2]
    )
    middle = (keys[:-1] + keys[1:]) / 2

    def at(moments: np.ndarray) -> np.ndarray:
        return flat_weights(mesh, np.interp(moments, times, curve[:, 0])[:, None])

    np.testing.assert_allclose(at(middle), (at(keys[:-1]) + at(keys[1:])) / 2, atol=1e-12)


def test_folding_undoes_flattening() -> None:
    mesh = curved(-0.4, 0.3, 2.0)
    flat, notes, _ = flat_mesh(mesh)
    steps = steps_in({"usdface": {"inbetweens": notes}}, flat.shape_names)
    assert steps == tuple(Step(0, f"at {w}", w, k + 1) for k, w in enumerate((-0.4, 0.3, 2.0)))
    weights = np.random.default_rng(0).uniform(-3, 3, (50, 1))
    whole, values, found = folded(flat, steps, flat_weights(mesh, weights))
    assert found == []
    np.testing.assert_allclose(values, weights, atol=1e-12)
    for one, two in zip(whole.shapes[0].inbetweens, mesh.shapes[0].inbetweens, strict=True):
        assert (one.name, one.weight) == (two.name, two.weight)
        np.testing.assert_array_equal(one.offsets, two.offsets)


def test_targets_that_moved_on_their_own_stay_shapes() -> None:
    flat, notes, _ = flat_mesh(curved(0.5))
    steps = steps_in({"usdface": {"inbetweens": notes}}, flat.shape_names)
    assert steps is not None
    mesh, values, found = folded(flat, steps, np.array([[0.2, 0.3]]))
    assert mesh is flat and values.shape == (1, 2)
    assert [f.code for f in found] == ["INBETWEEN_FLAT"]


def test_names_are_unique_and_places_too() -> None:
    mesh = curved(0.5)
    shape = mesh.shapes[0]
    again = Inbetween("at 0.5", 0.25, np.zeros((2, 3)))
    bad = (Inbetween("one", 1.0, np.zeros((2, 3))), replace(again, weight=0.5))
    taken = BlendShape("s:at 0.5", [1], [[1.0, 0, 0]])
    mesh = replace(
        mesh, shapes=(replace(shape, inbetweens=(*shape.inbetweens, again, *bad)), taken)
    )
    flat, _, found = flat_mesh(mesh)
    assert flat.shape_names == ("s", "s:at 0.5", "s:at 0.5_2", "s:at 0.5_3")
    assert [f.code for f in found] == ["INBETWEEN_DROPPED"] * 2


@pytest.mark.parametrize(
    "note",
    [
        None,
        {},
        {"shape": "a", "name": 1, "weight": 0.5, "target": "b"},
        {"shape": "a", "name": "n", "weight": "0.5", "target": "b"},
        {"shape": "a", "name": "n", "weight": True, "target": "b"},
        {"shape": "a", "name": "n", "weight": float("nan"), "target": "b"},
        {"shape": "a", "name": "n", "weight": 1, "target": "b"},
        {"shape": "a", "name": "n", "weight": 0.5, "target": "?"},
        {"shape": "a", "name": "n", "weight": 0.5, "target": ["b"]},
        {"shape": "a", "name": "n", "weight": 0.5, "target": "a"},
    ],
)
def test_extras_that_make_no_sense_are_refused(note) -> None:
    assert steps_in({"usdface": {"inbetweens": [note]}}, ["a", "b"]) is None
    assert steps_in({"usdface": [note]}, ["a", "b"]) == ()
    assert steps_in(note, ["a", "b"]) == ()


def take_for(rig: Rig) -> WeightsTake:
    rng = np.random.default_rng(5)
    names = rig.shape_names
    return WeightsTake(names, np.arange(40) / 60, rng.uniform(-1, 2, (40, len(names))), 60.0)


def test_a_player_shows_the_inbetweens_at_all_times(tmp_path: Path, face_rig: Rig, posed) -> None:
    take, path = take_for(face_rig), tmp_path / "a.glb"
    found = write_gltf(face_rig, path, plays(take))
    assert not any(f.code.startswith("INBETWEEN") for f in found)
    moments = np.linspace(0, take.times[-1], 301)
    for mesh, shown in zip(face_rig.meshes, evaluate_gltf(path), strict=True):
        weights = take.reordered(mesh.shape_names).weights
        at = np.stack([np.interp(moments, take.times, column) for column in weights.T], 1)
        points = np.unique(mesh.face_indices)  # the order of vertices, for each seam again
        for frame, seen in enumerate(shown.points_at(moments)):
            expected = posed(mesh, at[frame])[points]
            distance = np.linalg.norm(seen[:, None] - expected[None], axis=2)
            assert max(distance.min(0).max(), distance.min(1).max()) < 1e-6


def test_round_trip(tmp_path: Path, face_rig: Rig, validate_gltf) -> None:
    take, path = take_for(face_rig), tmp_path / "a.glb"
    write_gltf(face_rig, path, plays(take))
    rig, same, found = read_one(path)
    assert found == []
    assert same is not None and same.names == take.names and same.rate == 60.0
    np.testing.assert_allclose(same.times, take.times, atol=1e-6)
    np.testing.assert_allclose(same.weights, take.weights, atol=1e-6)
    for one, two in zip(face_rig.meshes, rig.meshes, strict=True):
        assert one.shape_names == two.shape_names
        for a, b in zip(one.shapes, two.shapes, strict=True):
            given = sorted(a.inbetweens, key=lambda x: x.weight)
            assert [(x.name, x.weight) for x in given] == [(x.name, x.weight) for x in b.inbetweens]
            for x, y in zip(given, b.inbetweens, strict=True):
                moved = np.isin(b.indices, a.indices)
                np.testing.assert_allclose(y.offsets[moved], x.offsets, atol=1e-9)
                assert not y.offsets[~moved].any()
    assert validate_gltf(path)["issues"]["numErrors"] == 0


def test_without_animation_too(tmp_path: Path, face_rig: Rig) -> None:
    write_gltf(face_rig, tmp_path / "a.glb")
    rig, take, _ = read_one(tmp_path / "a.glb")
    assert take is None
    assert [len(s.inbetweens) for s in rig.meshes[0].shapes] == [2, 0, 0, 0]


@pytest.mark.parametrize("keys", [[0], [2], [7, -1], [1, "x"], "1", {}])
def test_keys_are_only_taken_out_where_it_changes_nothing(tmp_path: Path, keys: object) -> None:
    path = tmp_path / "a.gltf"
    write_gltf(
        Rig("r", (curved(0.5),)), path, plays(WeightsTake(("s",), [0.0, 1.0], [[0.0], [1.0]]))
    )
    document = json.loads(path.read_text())
    ours = document["animations"][0]["extras"]["usdface"]
    assert ours == {"insertedKeys": [1]}
    take = read_one(path)[1]
    assert take is not None and take.times.tolist() == [0, 1]
    ours["insertedKeys"] = keys
    path.write_text(json.dumps(document))
    take = read_one(path)[1]
    assert take is not None and take.times.tolist() == [0, 0.5, 1]


def test_the_published_test_of_inbetweens(tmp_path: Path, shared_data: Path, baked) -> None:
    from pxr import Usd, UsdGeom

    folder = shared_data / "openusd_usdskel/bakeSkinning"
    source, path = folder / "blendshapes.usda", tmp_path / "a.glb"
    outcome = export_scene(source, path)
    assert not any(f.code.startswith("INBETWEEN") for f in outcome.findings)
    codes = np.arange(1.0, 132.0)
    shown, cache = evaluate_gltf(path)  # the latter made of the truth, points over time
    times = ((codes - 1) / 24).astype(np.float32)  # of the samples, as glTF holds them
    seen = shown.points_at(times) * 100  # its metersPerUnit is 0.01

    def points(file: Path, prim: str) -> np.ndarray:
        stage = Usd.Stage.Open(str(file))
        attribute = UsdGeom.Mesh(stage.GetPrimAtPath(prim)).GetPointsAttr()
        return np.array([attribute.Get(code) for code in codes])

    y_up = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    usd = baked(source, codes)["/TestPlane/Mesh"]
    baseline = points(folder / "baseline/blendshapes.baked.usda", "/TestPlane/Mesh")
    truth = points(source, "/GroundTruth/Mesh")
    assert np.abs(seen - usd @ y_up).max() < 1e-5
    assert np.abs(seen - baseline @ y_up).max() < 1e-3
    assert np.abs(seen - truth @ y_up).max() < 1e-3
    assert (
        cache.weights_at(times).shape[1] == 6
    )  # as many as its points are made of: five inbetweens, one shape
    assert np.abs(cache.points_at(times) * 100 - truth @ y_up).max() < 1e-4


def test_the_published_test_of_normals(tmp_path: Path, shared_data: Path) -> None:
    from pxr import Usd, UsdGeom

    source = shared_data / "openusd_usdskel/bakeSkinning/blendshapesWithNormals.usda"
    path = tmp_path / "a.glb"
    outcome = export_scene(source, path, every_frame=True)
    certificate = outcome.details["certificate"]
    assert certificate["vertex_error_max_mm"] < 1e-4  # a mesh of 10 cm
    assert certificate["normal_error_max_degrees"] < 1e-3
    stage = Usd.Stage.Open(str(source))
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/TestPlane/Mesh"))
    assert mesh.GetOrientationAttr().Get() == "leftHanded"
    quads = np.array(mesh.GetFaceVertexIndicesAttr().Get()).reshape(-1, 4)
    corners = np.array(mesh.GetPointsAttr().Get())[quads]
    outside = -np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    written = read_gltf(path)[0].meshes[0]
    a, b, c = written.points[written.face_indices].reshape(-1, 3, 3).swapaxes(0, 1)
    faces = np.cross(b - a, c - a)  # counter-clockwise seen from outside
    lengths = np.linalg.norm(faces[::2], axis=1) * np.linalg.norm(outside, axis=1)
    np.testing.assert_allclose((faces[::2] * outside).sum(axis=1) / lengths, 1, atol=1e-5)
