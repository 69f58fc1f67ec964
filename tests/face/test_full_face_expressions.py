"""Expressions of brows and mouth together."""

import numpy as np
import pytest
from marker_face import marker_face

from usdface.face.full_face_expressions import moves_brows_and_mouth
from usdface.setup.expression import Expression

PLACES = np.array([[0, 0, 0], [0.0, 0.03, 0], [0, -0.03, 0]])


def expression(*shapes: str) -> Expression:
    return Expression("it", shapes, np.ones(len(shapes)))


def test_names_tell_where_they_do():
    names = ("browDownLeft", "mouthFrownLeft", "cheekSquintLeft")
    basis = np.zeros((3, 3, 3))
    face = marker_face(("nose", "a", "b"), PLACES, basis, names, "nose")
    assert moves_brows_and_mouth(face, expression("browDownLeft", "mouthFrownLeft"))
    assert not moves_brows_and_mouth(face, expression("cheekSquintLeft", "mouthFrownLeft"))


@pytest.mark.parametrize(("above", "both"), [(6, True), (4, False)])
def test_without_names_by_how_far_markers_move_against_the_nose(above: float, both: bool):
    basis = np.zeros((1, 3, 3))
    basis[0, :, 1] = [0.002, 0.002 + 0.001 * above, -0.008]
    face = marker_face(("nose", "a", "b"), PLACES, basis, ("s1",), "nose")
    assert moves_brows_and_mouth(face, expression("s1")) is both
