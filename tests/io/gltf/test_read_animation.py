from pathlib import Path
from typing import Any

import numpy as np
import pytest
from clips import read_one

from usdface.errors import InputError
from usdface.io.gltf.read import read_gltf
from usdface.takes import WeightsTake

POINTS = np.eye(3, dtype="<f4")


class World:
    """Meshes with two targets each, and animations of their weights."""

    def __init__(self) -> None:
        self.arrays: list[np.ndarray] = [POINTS, POINTS]
        self.document: dict[str, Any] = {"nodes": [], "meshes": [], "animations": []}

    def mesh(self, *names: str, weights: list[float] | None = None) -> int:
        primitive = {"attributes": {"POSITION": 0}, "targets": [{"POSITION": 1}] * len(names)}
        mesh: dict[str, Any] = {"primitives": [primitive], "extras": {"targetNames": names}}
        node = {"mesh": len(self.document["meshes"]), "name": f"M{len(self.document['nodes'])}"}
        if weights is not None:
            node["weights"] = weights
        self.document["meshes"].append(mesh)
        self.document["nodes"].append(node)
        return len(self.document["nodes"]) - 1

    def curve(self, times: list[float], values: object, mode: str = "LINEAR") -> dict[str, Any]:
        self.arrays += [np.array(times, "<f4"), np.ravel(values).astype("<f4")]
        count = len(self.arrays)
        return {"input": count - 2, "output": count - 1, "interpolation": mode}

    def animate(self, **curves: dict[str, Any]) -> None:
        """Append an animation; `n3=curve` moves the weights of node 3."""
        channels = [
            {"sampler": k, "target": {"node": int(node[1:]), "path": "weights"}}
            for k, node in enumerate(curves)
        ]
        self.document["animations"].append(
            {"name": "clip", "channels": channels, "samplers": list(curves.values())}
        )

    def read(self, write_glb, folder: Path):
        return read_one(write_glb(folder / "a.glb", self.document, self.arrays))


def test_linear_keys_are_kept(write_glb, tmp_path: Path) -> None:
    world = World()
    world.mesh("jaw open", "口")
    world.animate(n0=world.curve([0, 0.5, 2], [[0, 1], [0.25, 5], [1, -2]]))
    _, take, found = world.read(write_glb, tmp_path)
    assert found == []
    assert take is not None
    assert take.names == ("jaw open", "口")
    np.testing.assert_array_equal(take.times, [0, 0.5, 2])
    np.testing.assert_array_equal(take.weights, [[0, 1], [0.25, 5], [1, -2]])


def test_steps_become_pairs_of_keys(write_glb, tmp_path: Path) -> None:
    world = World()
    world.mesh("a")
    world.animate(n0=world.curve([0, 1, 2, 3], [0, 1, 1, 0.5], "STEP"))
    _, take, _ = world.read(write_glb, tmp_path)
    assert take is not None
    times = np.array([0, 0.5, 0.999, 1, 1.5, 2.5, 2.999, 3, 4])
    values = np.interp(times, take.times, take.weights[:, 0])
    np.testing.assert_array_equal(values, [0, 0, 0, 1, 1, 1, 1, 0.5, 0.5])
    assert len(take.times) == 6  # no pair where nothing changes
    assert (np.diff(take.times.astype(np.float32)) > 0).all()


def test_cubic_curves_become_lines_within_the_stated_error(write_glb, tmp_path: Path) -> None:
    rng = np.random.default_rng(9)
    times = np.array([0, 0.4, 1.0, 2.5])
    keys = rng.normal(size=(4, 3, 2)).astype("<f4").astype(float)
    world = World()
    world.mesh("a", "b")
    world.animate(n0=world.curve(times.tolist(), keys, "CUBICSPLINE"))
    _, take, found = world.read(write_glb, tmp_path)
    assert take is not None
    assert [f.code for f in found] == ["CURVE_RESAMPLED"]
    times = times.astype(np.float32).astype(float)
    for _ in range(200):  # the specification's formula, one moment at a time
        t = rng.uniform(0, 2.5)
        k = int(np.searchsorted(times, t, "right") - 1)
        d = times[k + 1] - times[k]
        s = (t - times[k]) / d
        expected = (
            (2 * s**3 - 3 * s**2 + 1) * keys[k, 1]
            + d * (s**3 - 2 * s**2 + s) * keys[k, 2]
            + (-2 * s**3 + 3 * s**2) * keys[k + 1, 1]
            + d * (s**3 - s**2) * keys[k + 1, 0]
        )
        actual = [np.interp(t, take.times, column) for column in take.weights.T]
        assert np.abs(actual - expected).max() <= 0.82e-5  # the certificate's limit is 1e-5
    np.testing.assert_array_equal(take.weights[-1], keys[-1, 1])
    for time, key in zip(times, keys[:, 1], strict=True):
        np.testing.assert_allclose(take.weights[take.times == time], [key])


def test_wild_tangents_do_not_explode(write_glb, tmp_path: Path) -> None:
    world = World()
    world.mesh("a")
    world.animate(n0=world.curve([0, 1], [[0, 0, 1e30], [-1e30, 1, 0]], "CUBICSPLINE"))
    _, take, _ = world.read(write_glb, tmp_path)
    assert take is not None
    assert len(take.times) <= 2049


def test_equal_curves_share_a_name_and_others_get_their_own(write_glb, tmp_path: Path) -> None:
    world = World()
    for _ in range(3):
        world.mesh("jaw", "blink")
    same = world.curve([0, 1], [[0, 0], [1, 0.5]])
    other = world.curve([0, 0.5, 1], [[0, 0], [0.75, 0.25], [1, 0.5]])
    world.animate(n0=same, n1=same, n2=other)
    rig, take, found = world.read(write_glb, tmp_path)
    assert take is not None
    names = [mesh.shape_names for mesh in rig.meshes]
    assert names == [("jaw", "blink"), ("jaw", "blink"), ("M2:jaw", "blink")]
    assert [(f.code, f.where) for f in found] == [("NAME_CHANGED", "jaw")]
    # keys of all curves, none of them changed
    np.testing.assert_array_equal(take.times, [0, 0.5, 1])
    np.testing.assert_array_equal(take.column("jaw"), [0, 0.5, 1])
    np.testing.assert_array_equal(take.column("M2:jaw"), [0, 0.75, 1])


def test_a_mesh_that_stays_still_beside_one_that_moves(write_glb, tmp_path: Path) -> None:
    world = World()
    world.mesh("a")
    world.mesh("a", "b", weights=[0.25, 0.5])
    world.animate(n0=world.curve([0, 1], [0, 1]))
    rig, take, _ = world.read(write_glb, tmp_path)
    assert take is not None
    assert rig.meshes[1].shape_names == ("M1:a", "b")
    np.testing.assert_array_equal(take.column("M1:a"), [0.25, 0.25])
    np.testing.assert_array_equal(take.column("b"), [0.5, 0.5])


def test_new_names_meet_no_old_ones(write_glb, tmp_path: Path) -> None:
    world = World()
    world.mesh("a", "M1:a")
    world.mesh("M1:a", "a")
    world.animate(
        n0=world.curve([0, 1], [[0, 0], [1, 2]]), n1=world.curve([0, 1], [[0, 0], [2, 3]])
    )
    rig, take, _ = world.read(write_glb, tmp_path)
    assert take is not None
    assert rig.meshes[1].shape_names == ("M1:a", "M1:a_2")
    np.testing.assert_array_equal(take.weights[1], [1, 2, 3])


def test_weights_without_animation_are_one_frame(write_glb, tmp_path: Path) -> None:
    world = World()
    world.mesh("a", "b", weights=[0, 0.5])
    _, take, _ = world.read(write_glb, tmp_path)
    assert take is not None
    assert take.times.tolist() == [0]
    assert take.weights.tolist() == [[0, 0.5]]
    still = World()
    still.mesh("a", weights=[0])
    assert still.read(write_glb, tmp_path)[1] is None


def test_mesh_weights_count_where_the_node_has_none(write_glb, tmp_path: Path) -> None:
    world = World()
    world.mesh("a")
    world.mesh("b", weights=[0.75])
    for mesh in world.document["meshes"]:
        mesh["weights"] = [0.5]
    _, take, _ = world.read(write_glb, tmp_path)
    assert take is not None
    assert take.weights.tolist() == [[0.5, 0.75]]


def test_every_animation_is_a_clip(write_glb, tmp_path: Path) -> None:
    world = World()
    world.mesh("a", "b", weights=[0, 0.5])
    for name, last in (("Kopf ü", 1.0), ("口", 0.25)):
        world.animate(n0=world.curve([0, last], [[0, 0], [1, last]]))
        world.document["animations"][-1]["name"] = name
    _, clips, found = read_gltf(write_glb(tmp_path / "a.glb", world.document, world.arrays))
    assert found == []
    assert [clip.name for clip in clips] == ["Kopf ü", "口", ""]
    assert [clip.still for clip in clips] == [False, False, True]
    for clip, last in zip(clips[:2], (1.0, 0.25), strict=True):
        assert clip.joints is None and clip.weights is not None
        assert clip.weights.times.tolist() == [0, last]
        assert clip.weights.weights.tolist() == [[0, 0], [1, last]]


def test_a_name_is_shared_only_where_it_may_be_in_all_clips(write_glb, tmp_path: Path) -> None:
    world = World()
    world.mesh("a", "b")
    world.mesh("a", "b")
    same, other = world.curve([0, 1], [[0, 0], [1, 1]]), world.curve([0, 1], [[0, 1], [1, 1]])
    world.animate(n0=same, n1=same)
    world.animate(n0=same, n1=other)
    rig, clips, _ = read_gltf(write_glb(tmp_path / "a.glb", world.document, world.arrays))
    assert rig.meshes[1].shape_names == ("a", "M1:b")
    first, second = (clip.weights for clip in clips)
    assert first is not None and second is not None
    np.testing.assert_array_equal(first.column("M1:b"), first.column("b"))
    np.testing.assert_array_equal(second.column("M1:b"), [1, 1])


def test_what_moves_nothing_is_announced(write_glb, tmp_path: Path) -> None:
    world = World()
    world.mesh("a")
    world.mesh()
    world.document["nodes"].append({"name": "empty"})
    curve = world.curve([0, 1], [0, 1])
    world.document["animations"].append({"name": "walk", "channels": [], "samplers": []})
    world.animate(n0=curve, n1=curve)
    world.animate(n2=world.curve([0, 1], np.zeros((2, 3))))
    world.document["animations"][2]["channels"][0]["target"]["path"] = "translation"
    path = write_glb(tmp_path / "a.glb", world.document, world.arrays)
    _, clips, found = read_gltf(path)
    assert [clip.name for clip in clips] == ["clip"]
    assert [(f.code, f.where) for f in found] == [
        ("ANIMATION_DROPPED", "walk"),
        ("ANIMATION_DROPPED", "clip"),
        ("ANIMATION_DROPPED", "clip"),
    ]
    assert "weights of node 1" in found[1].message


@pytest.mark.parametrize(
    ("times", "values", "mode"),
    [
        ([0, 1], [0, 1, 2], "LINEAR"),
        ([0, 1], [0, 1], "CUBICSPLINE"),
        ([0, 0], [0, 1], "LINEAR"),
        ([1, 0], [0, 1], "STEP"),
        ([0, 1], [0, 1], "SPLINE"),
        ([0, np.nan], [0, 1], "LINEAR"),
        ([0, 1], [0, np.inf], "LINEAR"),
    ],
)
def test_malformed_curves_are_refused(write_glb, tmp_path, times, values, mode) -> None:
    world = World()
    world.mesh("a")
    world.animate(n0=world.curve(times, values, mode))
    with pytest.raises(InputError):
        world.read(write_glb, tmp_path)


def test_one_node_moved_twice_is_refused(write_glb, tmp_path: Path) -> None:
    world = World()
    world.mesh("a")
    world.animate(n0=world.curve([0, 1], [0, 1]))
    world.document["animations"][0]["channels"] *= 2
    with pytest.raises(InputError, match="twice"):
        world.read(write_glb, tmp_path)


@pytest.mark.parametrize("weights", [[0.5], [0.5] * 3, ["x", 1], [0, None]])
def test_weights_must_fit_the_targets(write_glb, tmp_path: Path, weights) -> None:
    world = World()
    world.mesh("a", "b", weights=weights)
    with pytest.raises(InputError):
        world.read(write_glb, tmp_path)


@pytest.mark.parametrize(
    ("times", "rate"),
    [
        (np.arange(100) / 60, 60.0),
        (np.arange(4000) * 1001 / 30000, 29.97),
        (np.delete(np.arange(100) / 25, [3, 40, 41]), 25.0),
        ([0, 1, 1.37, 4], 0.0),
        ([0], 0.0),
        ([0, 1e-6], 0.0),
    ],
)
def test_the_rate_is_that_of_the_grid_of_keys(write_glb, tmp_path, times, rate: float) -> None:
    world = World()
    world.mesh("a")
    world.animate(n0=world.curve(list(times), np.arange(len(times)) % 3 + 1))
    take: WeightsTake | None = world.read(write_glb, tmp_path)[1]
    assert take is not None
    assert take.rate == pytest.approx(rate, abs=2e-3)
