import json
import tracemalloc
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
from ict_face import ict_mesh
from slits import LIP_GAP, slit_face
from worlds import make_world

from usdface.binding.marker_places import free_places, marker_places
from usdface.cli import main
from usdface.errors import InputError
from usdface.io.bind_file import read_bind
from usdface.options import MarkerOptions
from usdface.pipeline.markers import make_markers
from usdface.rigs import BlendShape, Mesh
from usdface.setup.binding import Binding
from usdface.setup.binding_origin import origin_of

WORLD = make_world(head_moves=False)
MESH = WORLD.rig.face()
NONE = Binding((), np.zeros(0, int))


def test_the_first_markers_go_where_shapes_move_most_and_leave_less_and_less_unseen() -> None:
    found = marker_places(MESH, NONE, count=20, noise=3e-4)
    moved = np.linalg.norm(MESH.offsets_at(found.vertices), axis=2).max(axis=0)
    assert (moved > 0).all() and len(set(found.vertices.tolist())) == 20
    left = [len(found.undetermined_before), *(len(rest) for rest in found.undetermined)]
    assert left[0] == len(MESH.shape_names) and left == sorted(left, reverse=True)
    assert left[-1] == 0


def test_a_marker_that_is_missing_is_asked_for() -> None:
    kept = {name: v for name, v in WORLD.points.items() if not name.startswith("lid")}
    present = Binding(tuple(kept), np.array(list(kept.values())))
    found = marker_places(MESH, present, count=2, noise=3e-4)
    assert {"eyeBlinkLeft", "eyeBlinkRight"} <= set(found.undetermined_before)
    assert {"left eye", "right eye"} == {where.split(",")[0] for where in found.where}
    assert not {"eyeBlinkLeft", "eyeBlinkRight"} & set(found.undetermined[-1])
    extended = found.binding(present)
    assert extended.markers[: len(kept)] == tuple(kept)
    assert set(extended.markers[len(kept) :]) == {"left_eye_1", "right_eye_1"}


def with_more(points: np.ndarray, faces: np.ndarray, jaw: np.ndarray) -> Mesh:
    """Return the face with more vertices, and what jawOpen does to them."""
    opened = MESH.shapes[MESH.shape_names.index("jawOpen")]
    own = len(MESH.points) + np.arange(len(points))
    more = BlendShape(
        "jawOpen",
        np.concatenate([opened.indices, own]),
        np.concatenate([opened.offsets, jaw]),
    )
    return replace(
        MESH,
        points=np.concatenate([MESH.points, points]),
        face_counts=np.concatenate([MESH.face_counts, np.full(len(faces), faces.shape[1])]),
        face_indices=np.concatenate([MESH.face_indices, faces.ravel()]),
        shapes=tuple(more if shape is opened else shape for shape in MESH.shapes),
    )


def test_no_marker_is_asked_for_on_a_neck_that_goes_along_with_the_jaw() -> None:
    """Its long lever would tell much of the head's pose, if anyone wore a marker there."""
    chin = np.flatnonzero(np.isclose(MESH.points[:, 1], MESH.points[:, 1].min()))
    chin = chin[np.argsort(MESH.points[chin, 0])]
    rows = np.concatenate([chin, len(MESH.points) + np.arange(3 * len(chin))]).reshape(4, -1)
    down = np.array([[0.0, -0.05 * k, -0.01 * k] for k in (1, 2, 3)])
    neck = (MESH.points[chin] + down[:, None]).reshape(-1, 3)
    quads = np.stack([rows[1:, :-1], rows[1:, 1:], rows[:-1, 1:], rows[:-1, :-1]], -1).reshape(
        -1, 4
    )
    mesh = with_more(neck, quads, np.tile([0.0, -0.004, 0.0], (len(neck), 1)))
    present = Binding(tuple(WORLD.points), np.array(list(WORLD.points.values())))
    assert marker_places(mesh, present, count=5, noise=3e-4).vertices.max() < len(MESH.points)
    assert marker_places(mesh, NONE, count=20, noise=3e-4).vertices.max() < len(MESH.points)


def test_no_marker_is_asked_for_on_lashes() -> None:
    """They move most of all, beside the face and not of one piece with it."""
    lash = len(MESH.points) + np.arange(3)[None]
    mesh = with_more(0.01 * np.eye(3) + [0.0, 0.0, 0.1], lash, np.full((3, 3), 0.03))
    assert marker_places(mesh, NONE, count=10, noise=3e-4).vertices.max() < len(MESH.points)


@pytest.mark.slow
def test_markers_on_a_real_head_are_asked_for_on_its_face(shared_data: Path) -> None:
    """Not on the back of the head, the neck, the ears, the eyes or the teeth."""
    mesh = ict_mesh(shared_data)
    path = Path(__file__).parents[1] / "data" / "animface_ict_bind.json"
    worn = read_bind(path)[0].binding
    places = mesh.points[free_places(mesh, worn.points).vertices]
    reach, some = 0.02, mesh.points[worn.points]
    assert len(places) > 500
    assert (places > some.min(axis=0) - reach).all() and (places < some.max(axis=0) + reach).all()
    found = marker_places(mesh, worn, count=5, noise=3e-4)
    away = np.linalg.norm(mesh.points[found.vertices, None] - some, axis=2).min(axis=1)
    assert away.max() < 0.03  # once 0.129, on the neck


def test_no_marker_is_asked_for_where_the_lips_touch() -> None:
    face = slit_face()
    lips = int(np.flatnonzero(face.points[:, 1] > 0.02)[0])  # the mouth comes first
    quads = face.face_indices.reshape(-1, 4)
    quads = quads[(quads < lips).all(axis=1)]
    offsets = face.offsets_at(np.arange(lips))
    shapes = [BlendShape.from_dense(n, o) for n, o in zip(face.shape_names, offsets, strict=True)]
    mouth = Mesh(
        "mouth",
        face.points[:lips],
        np.full(len(quads), 4),
        quads.ravel(),
        shapes=tuple(s for s in shapes if len(s.indices)),
    )
    free = mouth.points[free_places(mouth, NONE.points).vertices]
    outside = np.abs(free[free[:, 2] > 0.003, 1])
    assert len(outside) and outside.min() > LIP_GAP


def test_markers_keep_a_width_apart_and_from_those_that_are_there() -> None:
    present = Binding(tuple(WORLD.points), np.array(list(WORLD.points.values())))
    free = free_places(MESH, present.points)
    found = marker_places(MESH, present, count=12, noise=3e-4)
    points = MESH.points[np.concatenate([present.points, found.vertices])]
    apart = np.linalg.norm(points[:, None] - points, axis=2)[len(present.points) :]
    assert np.sort(apart, axis=1)[:, 1].min() >= free.room > 0.003


@pytest.mark.parametrize(
    ("count", "expected"), [(0, "1 or more"), (-3, "1 or more"), (10**6, "1 to")]
)
def test_a_number_of_markers_that_cannot_be(count: int, expected: str) -> None:
    with pytest.raises(InputError, match=f"expected {expected}"):
        marker_places(MESH, NONE, count=count, noise=3e-4)


def test_the_number_of_markers_that_is_named_as_possible_is() -> None:
    with pytest.raises(InputError, match="expected 1 to") as caught:
        marker_places(MESH, NONE, count=10**6, noise=3e-4)
    most = int(str(caught.value).split()[-1])
    assert len(marker_places(MESH, NONE, count=most, noise=3e-4).vertices) == most


@pytest.mark.slow
def test_the_command_writes_a_binding_and_draws_it(tmp_path: Path) -> None:
    folder = WORLD.write(tmp_path)
    rig, bind = str(folder / "rig.usda"), str(folder / "bind.json")
    more, picture = tmp_path / "more.json", tmp_path / "more.png"
    wanted = ["markers", rig, "--bind", bind, "-n", "3", "-o", str(more), "--figure", str(picture)]
    assert main(wanted) == 0
    before, after = (json.loads(Path(p).read_text())["markers"] for p in (bind, more))
    assert len(after) == len(before) + 3
    assert all(after[name]["point"] == before[name]["point"] for name in before)
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert main(["markers", rig, "-n", "0"]) == 1


def test_the_binding_of_another_mesh_is_refused(tmp_path: Path) -> None:
    folder = WORLD.write(tmp_path)
    origin = asdict(origin_of(replace(MESH, points=[*MESH.points, [0, 0, 0]]), WORLD.take))
    other = tmp_path / "other.json"
    other.write_text(json.dumps(WORLD.bind | {"made_with": origin}))
    with pytest.raises(InputError, match="the binding was made for another mesh"):
        make_markers(folder / "rig.usda", bind=other, options=MarkerOptions(count=1))


def test_the_first_markers_of_a_rig_of_several_meshes_go_on_its_face(tmp_path: Path) -> None:
    head, first = Path(__file__).parents[2] / "examples" / "head.usdc", tmp_path / "first.json"
    assert main(["markers", str(head), "-n", "2", "-o", str(first)]) == 0
    assert json.loads(first.read_text())["mesh"] == "/Asset/Face/head"
    more = ["markers", str(head), "-n", "1", "--bind", str(first)]
    assert main(more) == 0


STRAY = 6 * 13 + 4  # beside the middle of the face, without a marker
CORNER = 0  # which no shape moves much


def far_off(mesh: Mesh, far: float, vertex: int = STRAY) -> Mesh:
    points = mesh.points.copy()
    points[vertex] += far * np.array([1.0, 1.0, 0.0])
    return replace(mesh, points=points)


def corner_far_off(mesh: Mesh, far: float) -> Mesh:
    return far_off(mesh, far, CORNER)


def torn(mesh: Mesh, far: float) -> Mesh:
    """Return the face with a shape that tears one vertex off."""
    opened = mesh.shapes[mesh.shape_names.index("jawOpen")]
    offsets = mesh.offsets_at(np.arange(len(mesh.points)))[mesh.shape_names.index("jawOpen")]
    offsets[STRAY] += far * np.array([1.0, 1.0, 0.0])
    wrong = BlendShape.from_dense("jawOpen", offsets)
    return replace(mesh, shapes=tuple(wrong if s is opened else s for s in mesh.shapes))


@pytest.mark.slow
@pytest.mark.parametrize("spoil", [far_off, corner_far_off, torn])
@pytest.mark.parametrize("far", [0.55, 30.0, 100.0, 1e6, 1e20])
def test_one_vertex_far_off_changes_neither_the_advice_nor_what_it_takes(
    spoil: Callable[[Mesh, float], Mesh], far: float
) -> None:
    present = Binding(tuple(WORLD.points), np.array(list(WORLD.points.values())))
    before = free_places(MESH, present.points)
    tracemalloc.start()
    try:
        found = free_places(spoil(MESH, far), present.points)
        taken = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert (STRAY if spoil is not corner_far_off else CORNER) not in found.vertices
    assert len(np.setxor1d(found.vertices, before.vertices)) <= 9  # its neighbours at most
    assert found.room == pytest.approx(before.room, rel=0.05)
    assert taken < 60e6


@pytest.mark.slow
def test_places_of_a_dense_skin_take_memory_with_its_size() -> None:
    """Not with the pairs of places that are near each other, which are some hundred million."""
    size = 250
    y, x = np.meshgrid(np.linspace(-0.1, 0.1, size), np.linspace(-0.1, 0.1, size), indexing="ij")
    points = np.stack([x.ravel(), y.ravel(), np.zeros(size**2)], axis=1)
    first = (np.arange(size - 1)[:, None] * size + np.arange(size - 1)).ravel()
    quads = np.stack([first, first + 1, first + size + 1, first + size], 1)
    near = [np.exp(-(((points[:, 0] - 0.02 * k) / 0.1) ** 2)) for k in range(-2, 3)]
    shapes = tuple(
        BlendShape.from_dense(f"s{k}", 0.01 * row[:, None] * np.ones(3))
        for k, row in enumerate(near)
    )
    mesh = Mesh("dense", points, np.full(len(quads), 4), quads.ravel(), shapes=shapes)
    tracemalloc.start()
    try:
        found = free_places(mesh, NONE.points)
        taken = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert 1000 < len(found.vertices) <= 2000
    assert taken < 150e6


@pytest.mark.parametrize("size", [0.5, 4.0])
def test_a_face_of_another_size_takes_the_same_places(size: float) -> None:
    """The size of a face is told by its lids."""
    faces = [slit_face(), slit_face().scaled(size)]
    one, other = (marker_places(mesh, NONE, count=6, noise=3e-4) for mesh in faces)
    np.testing.assert_array_equal(one.vertices, other.vertices)
    assert one.undetermined == other.undetermined
    rooms = []
    for mesh in faces:
        with pytest.raises(InputError) as caught:
            marker_places(mesh, NONE, count=10_000, noise=3e-4)
        rooms.append(str(caught.value))
    assert rooms[0] == rooms[1]
