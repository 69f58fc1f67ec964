"""Faces that are made up: the same each time, in the character's directions and in others'."""

from pathlib import Path

import numpy as np
import pytest
from faces import Face, make_face

from usdface.arrays import FloatArray
from usdface.correction.synthetic_faces import synthetic_faces, weights_without_emotion
from usdface.face.drawn_expressions import DRAWN


@pytest.fixture(scope="module")
def face() -> Face:
    return make_face("example", Path())


def made(face: Face, rigs: tuple[str, ...] | None = None) -> list[FloatArray]:
    def shown(weights: FloatArray) -> FloatArray:
        moved = face.bound.displacements(weights)
        return np.asarray((moved - moved[:, face.bound.nose, None]).reshape(len(weights), -1))

    return synthetic_faces(face.bound, face.expressions, shown, drawn=DRAWN, rigs=rigs)


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


def test_what_means_nothing_begins_with_rest() -> None:
    nothing = weights_without_emotion(("jawOpen", "mouthSmileLeft", "mouthSmileRight"))
    assert not nothing[0].any() and nothing[1:].any(axis=1).all()
