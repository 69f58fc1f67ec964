import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from skins import LIP, flat_skin, grid, joined_lips, make_head

from usdface.face.skin_patch import SkinPatch, skin_patch
from usdface.rigs import Mesh

HEAD = make_head()
PATCH = skin_patch(HEAD.mesh, HEAD.vertices)
PLACES = PATCH.place_of[HEAD.vertices]
SHAPES = HEAD.mesh.offsets_at(PATCH.vertices)
TURN = Rotation.from_rotvec([0.4, -1.1, 0.3]).as_matrix()
# Another face: bent, and of other proportions.
OTHER = PATCH.points * [1.05, 0.97, 1.2] + 0.003 * np.sin(40 * PATCH.points[:, [1, 2, 0]])
RNG = np.random.default_rng(3)


def moved_patch(turn: np.ndarray, size: float, offset: float) -> SkinPatch:
    points = size * PATCH.points @ turn.T + offset
    return SkinPatch(PATCH.vertices, PATCH.place_of, points, PATCH.triangles, size * PATCH.size)


def test_a_patch_is_the_connected_skin_near_the_markers() -> None:
    """Two sheets a metre wide, 1 mm apart; the markers are on one, in a corner."""
    places, quads = grid(21, 21)
    sheet = 0.05 * np.column_stack([places, np.zeros(len(places))])
    points = np.vstack([sheet, sheet + np.array([0, 0, 0.001])])
    faces = np.vstack([quads, quads + len(sheet)])
    mesh = Mesh("m", points, np.full(len(faces), 4), faces.ravel())
    bound = np.array([0, 3, 21 * 3, 21 * 3 + 3])
    patch = skin_patch(mesh, bound)
    far = np.linalg.norm(patch.points[:, None] - mesh.points[bound], axis=2).min(axis=1)
    assert far.max() < patch.size and 32 <= len(patch.triangles) < 40
    assert (patch.vertices < len(sheet)).all() and (patch.place_of[bound] >= 0).all()
    np.testing.assert_array_equal(mesh.points[patch.vertices], patch.points)
    np.testing.assert_array_equal(patch.place_of[patch.vertices], np.arange(len(patch.vertices)))


def test_polygons_are_fans_and_flat_triangles_are_left_out() -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [2, 1, 0], [1, 2, 0], [0, 1, 0], [2, 2, 0], [3, 3, 0]])
    counts, faces = [5, 3, 3], [0, 1, 2, 3, 4, 2, 5, 3, 3, 5, 5]
    mesh = Mesh("m", points.astype(float), np.array(counts), np.array(faces))
    patch = skin_patch(mesh, np.array([0, 2, 5]))
    expected = {(0, 1, 2), (0, 2, 3), (0, 3, 4), (2, 5, 3)}
    assert {tuple(patch.vertices[t].tolist()) for t in patch.triangles} == expected


def test_a_mesh_without_faces_has_an_empty_patch() -> None:
    none = np.zeros(0, np.int64)
    patch = skin_patch(Mesh("m", HEAD.mesh.points, none, none), HEAD.vertices)
    assert not len(patch.vertices) and (patch.place_of == -1).all()


def test_vertices_split_by_a_seam_share_a_place() -> None:
    places, quads = grid(5, 4)
    points = 0.01 * np.column_stack([places, np.zeros(len(places))])
    middle = np.flatnonzero(places[:, 0] == 2)
    twin = {int(v): len(points) + k for k, v in enumerate(middle)}
    right = places[quads, 0].min(axis=1) >= 2
    split = np.vectorize(lambda v: twin.get(v, v))(quads[right])
    faces = np.concatenate([quads[~right], split])
    torn = Mesh("m", np.vstack([points, points[middle]]), np.full(len(faces), 4), faces.ravel())
    patch = skin_patch(torn, np.array([0, 4, 15, 19]))
    assert len(patch.vertices) == len(points)
    np.testing.assert_array_equal(patch.place_of[list(twin.values())], patch.place_of[list(twin)])


def test_a_field_meets_its_values_and_is_constant_where_they_are() -> None:
    values = RNG.normal(size=(len(PLACES), 3))
    np.testing.assert_allclose(PATCH.field(PLACES, values)[PLACES], values, atol=1e-3)
    level = PATCH.field(PLACES, np.full((len(PLACES), 3), 2.0))
    np.testing.assert_allclose(level, 2.0, atol=1e-6)


def test_a_field_is_linear_in_its_values_and_knows_no_place_size_or_direction() -> None:
    values = RNG.normal(size=(len(PLACES), 3))
    field = PATCH.field(PLACES, values)
    np.testing.assert_allclose(PATCH.field(PLACES, 3.0 * values), 3.0 * field, atol=1e-9)
    moved = moved_patch(TURN, 40.0, 5.0).field(PLACES, values)
    np.testing.assert_allclose(moved, field, atol=1e-6)


def test_a_field_stays_within_its_values_but_for_little() -> None:
    values = np.zeros((len(PLACES), 3))
    values[10] = 1.0
    field = PATCH.field(PLACES, values)
    assert field.max() < 1.05 and field.min() > -0.1


def test_lips_that_touch_have_fields_of_their_own() -> None:
    mesh = joined_lips()
    upper, lower = 3 * LIP + 20, 2 * LIP + 20
    bound = np.array([upper, lower, 5 * LIP + 20, 20, 5 * LIP, 0])
    patch = skin_patch(mesh, bound)
    values = np.array([[1.0], [-1.0], [1.0], [-1.0], [0.0], [0.0]]) * np.ones(3)
    field = patch.field(patch.place_of[bound], values)
    beside = patch.place_of[[upper + 4, lower + 4]]
    np.testing.assert_allclose(field[beside, 0], [1.0, -1.0], atol=0.2)


def test_the_same_face_has_the_same_shapes() -> None:
    np.testing.assert_allclose(PATCH.transferred(PATCH.points, SHAPES), SHAPES, atol=1e-12)


def test_shapes_that_are_still_stay_still() -> None:
    assert np.abs(PATCH.transferred(OTHER, np.zeros_like(SHAPES))).max() < 1e-12


def test_shapes_turn_and_grow_with_both_faces() -> None:
    moved = PATCH.transferred(OTHER, SHAPES)
    turned = moved_patch(TURN, 40.0, 0.0).transferred(40.0 * OTHER @ TURN.T, 40 * SHAPES @ TURN.T)
    np.testing.assert_allclose(turned, 40.0 * moved @ TURN.T, atol=1e-8)


def test_a_face_that_lies_elsewhere_moves_alike() -> None:
    moved = PATCH.transferred(OTHER + np.array([0.1, -0.2, 0.3]), SHAPES)
    np.testing.assert_allclose(moved, PATCH.transferred(OTHER, SHAPES), atol=1e-9)


def test_a_shape_that_turns_a_whole_face_does_so_with_another() -> None:
    """But for where it turns it about, which the source's displacements decide."""
    turn = Rotation.from_rotvec([0.0, 0.0, 0.1]).as_matrix() - np.eye(3)
    (moved,) = PATCH.transferred(OTHER, (PATCH.points @ turn.T)[None])
    off = moved - OTHER @ turn.T
    assert np.abs(off - off.mean(axis=0)).max() < 0.03 * np.abs(moved).max()


@pytest.mark.parametrize("size", [0.5, 2.0])
def test_a_larger_face_moves_further(size: float) -> None:
    moved = PATCH.transferred(size * PATCH.points, SHAPES)
    ratio = (moved * SHAPES).sum() / (SHAPES**2).sum()
    assert abs(np.log(ratio / size)) < 0.2


def test_flat_skin_has_no_field_without_values_to_meet() -> None:
    mesh = flat_skin()
    bound = np.array([0, 14, 12 * 15, 12 * 15 + 14])
    patch = skin_patch(mesh, bound)
    assert np.abs(patch.field(patch.place_of[bound], np.zeros((4, 3)))).max() == 0.0
