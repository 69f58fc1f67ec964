from dataclasses import replace

import numpy as np
import pytest
from skins import LIP, STEP, flat_skin, joined_lips, make_head

from usdface.blend_shapes.vertex_evaluator import evaluator_of
from usdface.face.dot_skin import dot_skin
from usdface.rigs import BlendShape

MIDDLE = 6 * 15 + 7  # of the flat skin


def areas(skin, points):
    """The area of each part when the vertices of the skin are at points."""
    a, b, c = (points[skin.triangles[:, k]] for k in range(3))
    return skin.shares * 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)


def test_a_dot_covers_a_disc() -> None:
    for radius in (0.4 * STEP, 1.7 * STEP, 3.0 * STEP):
        skin = dot_skin(flat_skin(), np.array([MIDDLE]), np.array([radius]))
        np.testing.assert_allclose(areas(skin, skin.points).sum(), np.pi * radius**2, rtol=0.02)
        np.testing.assert_allclose(skin.rest[0], flat_skin().points[MIDDLE], atol=0.01 * radius)


def test_a_dot_moves_as_the_mean_of_its_skin() -> None:
    flat = flat_skin()
    across = flat.points - flat.points[MIDDLE]
    bump = np.zeros_like(flat.points)
    bump[:, 2] = (across**2).sum(axis=1)  # its mean over a disc is half of that at the edge
    mesh = flat_skin((BlendShape("bump", np.arange(len(bump)), bump),))
    radius = 3.0 * STEP
    skin = dot_skin(mesh, np.array([MIDDLE]), np.array([radius]))
    moved = skin.marker_evaluator.displacements(np.ones((1, 1)))[0]
    # Flat triangles lie above the bump: by a sixth of the squared step along either side.
    assert moved[2] == pytest.approx(0.5 * radius**2 + STEP**2 / 3, rel=0.01)
    np.testing.assert_array_equal(skin.offsets[0, 0], moved)


def test_a_dot_without_radius_is_its_vertex_to_the_last_bit() -> None:
    head = make_head()
    skin = dot_skin(head.mesh, head.vertices, np.full(len(head.vertices), np.nan))
    exact, _ = evaluator_of(head.mesh.shapes, head.vertices)
    np.testing.assert_array_equal(skin.rest, head.points)
    np.testing.assert_array_equal(skin.marker_evaluator.offsets, exact.offsets)


def test_some_dots_are_those() -> None:
    head = make_head()
    radii = np.linspace(0.001, 0.006, len(head.vertices))
    radii[2] = np.nan
    whole, some = dot_skin(head.mesh, head.vertices, radii), np.array([7, 2, 4])
    np.testing.assert_allclose(whole.select(some).rest, whole.rest[some], atol=1e-15)
    np.testing.assert_array_equal(whole.select(some).radii, radii[some])


def test_a_dot_on_one_lip_leaves_the_other_and_a_dot_in_the_corner_has_both() -> None:
    on_the_lip, in_the_corner = 2 * LIP + LIP // 2, 2 * LIP
    skin = dot_skin(joined_lips(), np.array([on_the_lip, in_the_corner]), np.full(2, 0.004))
    opened = skin.marker_evaluator.displacements(np.ones((1, 1))).reshape(2, 3)
    assert opened[0, 1] == pytest.approx(-0.01)
    assert -0.007 < opened[1, 1] < -0.003


def test_skin_that_faces_the_other_way_is_not_painted() -> None:
    flat = flat_skin()
    quads = flat.face_indices.reshape(-1, 4)
    behind = np.where(quads == MIDDLE, MIDDLE, quads + len(flat.points))[:, ::-1]
    fold = replace(
        flat,
        points=np.concatenate([flat.points, flat.points]),
        face_counts=np.tile(flat.face_counts, 2),
        face_indices=np.concatenate([quads, behind]).ravel(),
    )
    beside = MIDDLE + 1  # on the side that has three of its four faces
    skin = dot_skin(fold, np.array([beside]), np.array([2.0 * STEP]))
    assert (skin.vertices < len(flat.points)).all()
