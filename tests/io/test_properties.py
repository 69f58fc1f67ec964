"""Whatever a face is called and however it moves: it goes round and comes back (hypothesis)."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from usdface.clips import Clip
from usdface.io.gltf.read import read_gltf
from usdface.io.gltf.write import write_gltf
from usdface.io.usd.clips import animated_rig
from usdface.io.usd.rig_write import write_rig
from usdface.io.usd.stage import open_stage
from usdface.pipeline import export_scene, import_scene
from usdface.rigs import BlendShape, Inbetween, Mesh, Rig
from usdface.takes import WeightsTake

# The same examples every time; a slow machine is no failure.
SAME = settings(
    derandomize=True,
    deadline=None,
    max_examples=12,
    database=None,
    phases=(Phase.generate,),  # a smaller example would take minutes to find
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
NAMES = st.text(st.characters(exclude_categories=["Cs", "Cc"]), min_size=1, max_size=8)
PLACES = st.integers(-8, 16).filter(lambda k: k not in (0, 8)).map(lambda k: k / 8)
WEIGHTS = st.floats(-1, 2, width=32, allow_subnormal=False)


@st.composite
def shapes(draw, name, count):
    moved = sorted(draw(st.sets(st.integers(0, count - 1), min_size=1)))
    rng = np.random.default_rng(draw(st.integers(0, 99)))

    def vectors(size):
        return rng.normal(0, size, (len(moved), 3))

    places = sorted(draw(st.sets(PLACES, max_size=2)))
    between = tuple(
        Inbetween(f"{name} {k}", place, vectors(0.01), vectors(0.1))
        for k, place in enumerate(places)
    )
    return BlendShape(name, moved, vectors(0.01), vectors(0.1), between)


@st.composite
def meshes(draw, name, shape_names):
    faces = draw(st.integers(2, 6))
    count = 3 * faces
    rng = np.random.default_rng(draw(st.integers(0, 99)))
    normals = rng.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    own = [n for n in shape_names if draw(st.booleans())] or list(shape_names[:1])
    return Mesh(
        name,
        rng.normal(size=(count, 3)),
        np.full(faces, 3),
        rng.permutation(count),
        normals,
        rng.random((count, 2)) if draw(st.booleans()) else None,
        tuple(draw(shapes(n, count)) for n in own),
    )


@st.composite
def clips(draw, name, shape_names):
    codes = sorted(draw(st.sets(st.integers(0, 120), min_size=2, max_size=6)) | {0})
    rows = [[draw(WEIGHTS) for _ in shape_names] for _ in codes]
    return Clip(name, WeightsTake(shape_names, np.array(codes) / 24, np.array(rows), 24.0))


@st.composite
def faces(draw):
    names = tuple(draw(st.lists(NAMES, min_size=1, max_size=4, unique=True)))
    heads = draw(st.lists(NAMES, min_size=1, max_size=3))
    rig = Rig(draw(NAMES), tuple(draw(meshes(name, names)) for name in heads))
    titles = draw(st.lists(NAMES, min_size=1, max_size=3, unique=True))
    return rig, tuple(draw(clips(title, rig.shape_names)) for title in titles)


def from_usd(path: Path):
    rig, found, _ = animated_rig(open_stage(path))
    return rig, found


def from_gltf(path: Path):
    rig, found, _ = read_gltf(path)
    return rig, found


def assert_same(one, other):
    (rig, played), (again, replayed) = one, other
    assert again.name == rig.name
    assert [(m.name, m.shape_names) for m in again.meshes] == [
        (m.name, m.shape_names) for m in rig.meshes
    ]
    assert [clip.name for clip in replayed] == [clip.name for clip in played]
    for a, b in zip(played, replayed, strict=True):
        np.testing.assert_allclose(b.weights.times, a.weights.times, rtol=0, atol=1e-6)
        weights = b.weights.reordered(a.weights.names).weights
        np.testing.assert_allclose(weights, a.weights.weights, rtol=0, atol=1e-6)
    for a, b in zip(rig.meshes, again.meshes, strict=True):
        limit = 1e-5 * np.linalg.norm(np.ptp(a.points, axis=0))
        mine, its = a.face_indices, b.face_indices
        np.testing.assert_allclose(b.points[its], a.points[mine], rtol=0, atol=limit)
        for x, y in zip(a.shapes, b.shapes, strict=True):
            assert [i.weight for i in x.inbetweens] == [i.weight for i in y.inbetweens]
            assert [i.name for i in x.inbetweens] == [i.name for i in y.inbetweens]
            for p, q in zip((x, *x.inbetweens), (y, *y.inbetweens), strict=True):
                for field, most in (("offsets", limit), ("normal_offsets", 1e-5)):
                    dense = np.zeros((2, max(len(a.points), len(b.points)), 3))
                    dense[0, x.indices] = getattr(p, field)
                    dense[1, y.indices] = getattr(q, field)
                    np.testing.assert_allclose(dense[1][its], dense[0][mine], rtol=0, atol=most)


def certified(outcome, played):
    found = outcome.details["certificate"]
    assert found["vertex_error_max_mm"] <= 1e-5 * found["bounding_diagonal_mm"]
    # Inbetweens ask for keys between keys, whose times have 32 bits and are told apart from
    # 1e-6 of their size on: a fast weight shows it.
    takes = [clip.weights for clip in played]
    speed = max(np.abs(np.diff(t.weights, axis=0) / np.diff(t.times)[:, None]).max() for t in takes)
    late = 1e-6 * (1 + max(t.times[-1] for t in takes))
    assert found["weight_error_max"] <= 1e-6 + speed * late
    assert found["time_drift_s"] <= 1e-6
    assert found["missing"] == []


@pytest.mark.slow
@SAME
@given(face=faces())
def test_usd_to_gltf_to_usd(face, tmp_path):
    one, two, three = (tmp_path / name for name in ("one.usdc", "two.glb", "three.usdc"))
    write_rig(face[0], one, face[1])
    assert_same(face, from_usd(one))
    certified(export_scene(one, two, every_frame=True), face[1])
    certified(import_scene(two, three, every_frame=True), face[1])
    assert_same(face, from_usd(three))


@pytest.mark.slow
@SAME
@given(face=faces())
def test_gltf_to_usd_to_gltf(face, tmp_path):
    one, two, three = (tmp_path / name for name in ("one.glb", "two.usda", "three.glb"))
    write_gltf(face[0], one, face[1])
    assert_same(face, from_gltf(one))
    certified(import_scene(one, two, every_frame=True), face[1])
    certified(export_scene(two, three, every_frame=True), face[1])
    assert_same(face, from_gltf(three))


@pytest.mark.parametrize("seed", range(2))
def test_conversions_are_reproducible(seed, tmp_path):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(6, 3))
    shape = BlendShape("a", [1, 2], rng.normal(size=(2, 3)))
    rig = Rig("r", (Mesh("m", points, [3, 3], [0, 1, 2, 3, 4, 5], shapes=(shape,)),))
    clip = Clip("c", WeightsTake(("a",), [0.0, 1.0], [[0.0], [1.0]], 24.0))
    for name in ("a.usdc", "b.usdc", "a.glb", "b.glb"):
        (write_gltf if name.endswith("glb") else write_rig)(rig, tmp_path / name, (clip,))
    assert (tmp_path / "a.usdc").read_bytes() == (tmp_path / "b.usdc").read_bytes()
    assert (tmp_path / "a.glb").read_bytes() == (tmp_path / "b.glb").read_bytes()
