from dataclasses import replace

import numpy as np
import pytest
from skins import LIP, STEP, flat_skin, joined_lips, make_head

from usdface.blend_shapes.vertex_evaluator import evaluator_of
from usdface.face.dot_skin import dot_skin
from usdface.face.marker_surface import MarkerSurface
from usdface.rigs import BlendShape, Combination, Inbetween, Mesh

HEAD = make_head()
# On the flat skin: inner vertices, and shifts of less than a centimetre along it.
VERTICES = np.array([4 * 15 + 5, 6 * 15 + 7, 8 * 15 + 9])
RNG = np.random.default_rng(4)


def linear_fields(mesh: Mesh) -> tuple[Mesh, np.ndarray]:
    """Give a skin three shapes that are linear in place: (3, 3, 3) of them, value by place."""
    slopes = 0.3 * np.random.default_rng(2).normal(size=(3, 3, 3))
    fields = np.einsum("vi,sij->svj", mesh.points, slopes) + 0.002
    shapes = [BlendShape.from_dense(f"f{k}", field) for k, field in enumerate(fields)]
    return replace(mesh, shapes=tuple(shapes)), slopes


def along_the_skin(size: float) -> np.ndarray:
    mesh = flat_skin()
    plane = np.linalg.svd(mesh.points, full_matrices=False)[2][:2]
    return size * RNG.uniform(-1, 1, (len(VERTICES), 2)) @ plane


def test_a_place_on_its_vertex_is_that_vertex_to_the_last_bit() -> None:
    placed = HEAD.surface.at(np.zeros((len(HEAD.vertices), 3)))
    exact, _ = evaluator_of(HEAD.mesh.shapes, HEAD.vertices)
    np.testing.assert_array_equal(placed.points, HEAD.points)
    np.testing.assert_array_equal(placed.evaluator.offsets, exact.offsets)


def test_a_dot_beside_its_vertex_is_the_mean_of_the_skin_there() -> None:
    radii = np.full(len(HEAD.vertices), 0.008)
    surface = MarkerSurface(HEAD.mesh, HEAD.vertices, radii)
    beside = HEAD.vertices + 38
    placed = surface.at(HEAD.mesh.points[beside] - HEAD.points)
    there = dot_skin(HEAD.mesh, beside, radii)
    np.testing.assert_allclose(placed.points, there.rest, atol=1e-15)
    np.testing.assert_allclose(placed.evaluator.offsets, there.marker_evaluator.offsets, atol=1e-15)
    one = surface.select(np.array([3])).at(np.zeros((1, 3)))
    whole = surface.at(np.zeros_like(HEAD.points))
    np.testing.assert_allclose(one.points, whole.points[3:4], atol=1e-15)


def test_a_place_on_another_vertex_is_that_one() -> None:
    beside = HEAD.vertices + 38
    placed = HEAD.surface.at(HEAD.mesh.points[beside] - HEAD.points)
    np.testing.assert_allclose(placed.points, HEAD.mesh.points[beside], atol=1e-15)
    exact, _ = evaluator_of(HEAD.mesh.shapes, beside)
    np.testing.assert_allclose(placed.evaluator.offsets, exact.offsets, atol=1e-15)


def test_on_a_plane_points_and_linear_shapes_are_exact() -> None:
    mesh, slopes = linear_fields(flat_skin())
    shifts = along_the_skin(1.4 * STEP)
    placed = MarkerSurface(mesh, VERTICES).at(shifts)
    there = mesh.points[VERTICES] + shifts
    np.testing.assert_allclose(placed.points, there, atol=1e-14)
    fields = np.einsum("mi,sij->smj", there, slopes) + 0.002
    np.testing.assert_allclose(placed.evaluator.offsets, fields.reshape(3, -1), atol=1e-14)
    for axis, slope in enumerate(placed.slopes):
        along = np.einsum("mi,sij->smj", placed.tangents[:, axis], slopes)
        np.testing.assert_allclose(slope.offsets, along.reshape(3, -1), atol=1e-12)


def test_a_shift_off_the_skin_counts_along_it_only() -> None:
    mesh, _ = linear_fields(flat_skin())
    shifts = along_the_skin(STEP)
    normal = np.linalg.svd(mesh.points, full_matrices=False)[2][2]
    surface = MarkerSurface(mesh, VERTICES)
    lifted = surface.at(shifts + 0.003 * normal)
    np.testing.assert_allclose(lifted.points, surface.at(shifts).points, atol=1e-14)


def test_slopes_are_those_of_the_displacements() -> None:
    """Beside finite differences, on a bent skin, at any weights."""
    shifts = HEAD.beside(0.002, seed=1)
    placed, small = HEAD.surface.at(shifts), 1e-6
    np.testing.assert_allclose(
        placed.tangents @ placed.tangents.transpose(0, 2, 1),
        np.broadcast_to(np.eye(2), (len(shifts), 2, 2)),
        atol=1e-12,
    )
    weights = HEAD.weights[30:33]
    for axis, slope in enumerate(placed.slopes):
        step = small * placed.tangents[:, axis]
        ahead = HEAD.surface.at(shifts + step).evaluator.displacements(weights)
        behind = HEAD.surface.at(shifts - step).evaluator.displacements(weights)
        numeric = (ahead - behind) / (2 * small)
        np.testing.assert_allclose(slope.displacements(weights), numeric, atol=1e-8)


def test_a_smooth_head_is_followed_within_a_tenth_of_the_shift() -> None:
    """Shapes at the middle of an edge are those of its ends, but for the second order."""
    beside = HEAD.vertices + 1
    middle = (HEAD.mesh.points[beside] - HEAD.points) / 2
    found = HEAD.surface.at(middle).evaluator.offsets
    own, next_one = (evaluator_of(HEAD.mesh.shapes, v)[0].offsets for v in (HEAD.vertices, beside))
    error = np.sqrt(np.mean((found - (own + next_one) / 2) ** 2))
    assert error < 0.1 * np.sqrt(np.mean((own - next_one) ** 2))


def test_no_place_crosses_from_one_lip_to_the_other() -> None:
    """The other lip is 0.1 mm away, and 8 cm along the skin."""
    mesh = joined_lips()
    ends = [0, LIP - 1, 5 * LIP, 6 * LIP - 1]
    surface = MarkerSurface(mesh, np.array([3 * LIP + 20, 2 * LIP + 20, *ends]))
    shifts = np.zeros((6, 3))
    shifts[:2, 1] = -0.002, 0.002  # across
    shifts[:2, 0] = 0.0005
    assert surface.reach > 0.003
    offsets = surface.at(shifts).evaluator.offsets.reshape(6, 3)
    np.testing.assert_allclose(offsets[:2, 1], [0.0, -0.01], atol=1e-12)
    upper, lower = (set(surface.vertices_near(marker).tolist()) for marker in (0, 1))
    assert min(upper) >= 3 * LIP > max(lower) and len(upper) == len(lower) >= 6


def test_where_lips_touch_a_place_stays_on_its_own() -> None:
    """Next to the corner the other lip is near along the skin, too, at the very same place."""
    mesh = joined_lips(gap=0.0)
    upper, lower = 3 * LIP + 2, 2 * LIP + 2
    np.testing.assert_array_equal(mesh.points[upper], mesh.points[lower])
    ends = LIP * np.arange(6)
    surface = MarkerSurface(mesh, np.array([upper, lower, *ends, *(ends + LIP - 1)]))
    assert lower in surface.vertices_near(0)
    for shift in (0.0, 0.0004):
        placed = surface.at(np.full((14, 3), [shift, 0.0, 0.0]))
        np.testing.assert_array_equal(placed.vertices[:2], [upper, lower])
        moved = placed.evaluator.offsets.reshape(14, 3)[:2, 1]
        np.testing.assert_allclose(moved, [0.0, -0.01], atol=0.0005)


def test_inbetweens_and_combinations_follow_the_place() -> None:
    """Beside a skin that has a vertex at the place."""
    mesh = linear_fields(flat_skin())[0]
    second = mesh.shapes[1].offsets
    shapes = (
        replace(mesh.shapes[0], inbetweens=(Inbetween("half", 0.4, second),)),
        mesh.shapes[1],
        replace(mesh.shapes[2], combination=Combination(("f0", "f1"))),
    )
    mesh = replace(mesh, shapes=shapes)
    shifts = along_the_skin(1.4 * STEP)
    evaluator = MarkerSurface(mesh, VERTICES).at(shifts).evaluator
    # Linear fields of the moved vertices: the same functions of place.
    moved = mesh.points.copy()
    moved[VERTICES] += shifts
    _, slopes = linear_fields(mesh)
    fields = np.einsum("vi,sij->svj", moved, slopes) + 0.002
    exact = tuple(
        replace(
            shape,
            offsets=fields[k],
            inbetweens=(Inbetween("half", 0.4, fields[1]),) if k == 0 else (),
        )
        for k, shape in enumerate(shapes)
    )
    judge, _ = evaluator_of(exact, VERTICES)
    weights = np.array([[0.2, 0.7], [0.4, 0.0], [0.9, 1.0], [-0.1, 0.3]])
    np.testing.assert_allclose(
        evaluator.displacements(evaluator.complete(weights)),
        judge.displacements(judge.complete(weights)),
        atol=1e-13,
    )


def test_reach_and_places_scale_with_the_skin() -> None:
    shifts = HEAD.beside(0.003, seed=3)
    large = replace(
        HEAD.mesh,
        points=1000 * HEAD.mesh.points,
        shapes=tuple(replace(s, offsets=1000 * s.offsets) for s in HEAD.mesh.shapes),
    )
    surface = MarkerSurface(large, HEAD.vertices)
    assert surface.reach == pytest.approx(1000 * HEAD.surface.reach)
    assert HEAD.surface.reach > 2 * STEP
    found, small = surface.at(1000 * shifts), HEAD.surface.at(shifts)
    np.testing.assert_allclose(found.points, 1000 * small.points, rtol=1e-9)
    np.testing.assert_allclose(found.evaluator.offsets, 1000 * small.evaluator.offsets, atol=1e-9)


def test_some_markers_are_those_of_the_whole() -> None:
    shifts, some = HEAD.beside(0.003, seed=3), np.array([30, 4, 17])
    whole, part = HEAD.surface.at(shifts), HEAD.surface.select(some)
    np.testing.assert_array_equal(part.vertices, HEAD.vertices[some])
    np.testing.assert_array_equal(part.mesh.points, HEAD.mesh.points)
    # Neighbourhoods are as wide as the markers are spread.
    np.testing.assert_allclose(part.at(shifts[some]).points, whole.points[some], atol=3e-4)


def test_a_vertex_of_no_face_has_no_places_beside_it() -> None:
    skin = flat_skin()
    lonely = BlendShape("up", np.array([195]), np.array([[0.0, 0.01, 0.0]]))
    points = np.vstack([skin.points, [[0.0, 0.0, 0.2]]])
    mesh = Mesh("m", points, skin.face_counts, skin.face_indices, shapes=(lonely,))
    shifts = np.zeros((4, 3))
    shifts[3] = [0.004, 0.0, 0.0]
    placed = MarkerSurface(mesh, np.array([*VERTICES, 195])).at(shifts)
    np.testing.assert_array_equal(placed.points[3], points[195])
    np.testing.assert_array_equal(placed.evaluator.offsets[0, 9:], [0.0, 0.01, 0.0])
    assert not any(slope.offsets[:, 9:].any() for slope in placed.slopes)


@pytest.mark.parametrize("known", [False, True])
def test_limits_that_are_known_by_name_hold_beside_vertices_too(known: bool) -> None:
    names = ("jawOpen", "mouthClose")
    shapes = tuple(replace(s, name=n) for s, n in zip(HEAD.mesh.shapes, names, strict=False))
    mesh = replace(HEAD.mesh, shapes=shapes)
    surface = MarkerSurface(mesh, HEAD.vertices, known_limits=known).select(np.arange(7))
    shifted = surface.at(HEAD.beside(0.003, seed=5)[:7])
    expected = [[1, 0]] if known else []
    for skin in (surface.skin, shifted.skin, surface.with_shapes(shapes).skin):
        assert skin.marker_evaluator.limits.tolist() == expected
