"""Faces that are made up: the same each time, in the character's directions and in others'."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from faces import Face, make_face

from usdface.arrays import FloatArray
from usdface.correction.synthetic_faces import synthetic_faces, weights_without_emotion
from usdface.face.drawn_expressions import DRAWN
from usdface.face.symmetry import mirrored_pairs
from usdface.rigs import BlendShape


@pytest.fixture(scope="module")
def face() -> Face:
    return make_face("example", Path())


def made(face: Face, rigs: tuple[str, ...] | None = None) -> list[FloatArray]:
    def coordinates_of(weights: FloatArray) -> FloatArray:
        moved = face.bound.displacements(weights)
        return np.asarray((moved - moved[:, face.bound.nose, None]).reshape(len(weights), -1))

    return synthetic_faces(face.bound, face.expressions, coordinates_of, drawn=DRAWN, rigs=rigs)


def test_they_are_the_same_each_time_and_finite(face: Face) -> None:
    for one, two in zip(made(face), made(face), strict=True):
        assert one.shape == two.shape and np.isfinite(one).all()
        np.testing.assert_array_equal(one, two)


def test_other_rigs_add_directions_that_the_character_has_not(face: Face) -> None:
    alone, all_rigs = made(face, rigs=()), made(face)
    basis = np.linalg.svd(alone[0], full_matrices=False)[2][: len(face.mesh.shapes)]
    beyond = all_rigs[0] - all_rigs[0] @ basis.T @ basis
    assert len(all_rigs[0]) > len(alone[0])
    assert np.linalg.norm(alone[0] - alone[0] @ basis.T @ basis) < 1e-9
    assert np.linalg.norm(beyond) > 0.1 * np.linalg.norm(all_rigs[0])


def test_what_means_nothing_begins_with_rest(face: Face) -> None:
    nothing = weights_without_emotion(face.bound)
    assert not nothing[0].any() and nothing[-1].any()
    single = nothing[nothing.max(axis=1) == 1.0]
    assert {tuple(row) for row in np.eye(len(face.bound.shape_names))} <= set(map(tuple, single))


def with_shapes(face: Face, shapes: tuple[BlendShape, ...]) -> Face:
    bound = replace(face.bound, mesh=replace(face.bound.mesh, shapes=shapes)).with_sorted_shapes()
    return replace(face, bound=bound)


def test_a_blend_shape_that_moves_no_marker_changes_nothing(face: Face) -> None:
    """Nor does the order of the others."""
    shapes = face.bound.mesh.shapes
    still = BlendShape("earWiggle", np.array([0]), np.zeros((1, 3)))
    without, beside = with_shapes(face, shapes), with_shapes(face, (still, *shapes[::-1]))
    for one, two in zip(made(without), made(beside), strict=True):
        np.testing.assert_allclose(one, two, atol=1e-15)
    kept = [name != "earWiggle" for name in beside.bound.shape_names]
    nothing = weights_without_emotion(beside.bound)
    np.testing.assert_array_equal(nothing[:, kept], weights_without_emotion(without.bound))
    assert not nothing[:, np.logical_not(kept)].any()


def test_faces_come_with_their_mirror_images(face: Face) -> None:
    """By weights: the same faces, with left for right, of a pose that is alike on both sides."""
    names = face.bound.shape_names
    mirror = np.arange(len(names))
    for left, right in mirrored_pairs(names):
        mirror[[left, right]] = right, left
    weights: list[FloatArray] = []

    def coordinates_of(rows: FloatArray) -> FloatArray:
        weights.append(rows)
        return np.zeros((len(rows), 3 * len(face.bound.markers)))

    synthetic_faces(face.bound, face.expressions, coordinates_of, drawn=DRAWN, rigs=())
    for rows in (*weights, weights_without_emotion(face.bound)):
        ordered, mirrored = (each[np.lexsort(each.T)] for each in (rows, rows[:, mirror]))
        np.testing.assert_allclose(ordered, mirrored, atol=1e-12)
