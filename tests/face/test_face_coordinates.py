"""Places on a face: the same numbers on every face, whatever its size and where it stands."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from faces import make_face

from usdface.face.bound_face import BoundFace
from usdface.face.face_coordinates import coordinates_on
from usdface.face.layout import FaceLayout


@pytest.fixture(scope="module")
def face() -> BoundFace:
    return make_face("example", Path()).bound


def test_eyes_are_above_the_mouth_and_left_is_positive(face: BoundFace) -> None:
    on = coordinates_on(face, face.neutral)
    assert on is not None
    at = dict(zip(face.markers, on.places, strict=True))
    assert at["lip_corner_left"][0] > 0.2 and abs(at["lip_corner_left"][1] + 1.0) < 0.1
    assert at["lip_corner_right"][0] < -0.2
    assert at["brow_left_inner"][1] > 0.2 and at["chin"][1] < -1.3
    slits = dict(zip(face.markers, on.slits.tolist(), strict=True))
    assert slits["lip_upper"][0] == 1 and slits["lip_lower"][0] == -1
    assert slits["chin"] == slits["nose_tip"] == [0, 0]


def test_they_do_not_depend_on_size_or_place(face: BoundFace) -> None:
    on = coordinates_on(face, face.neutral)
    mesh = replace(face.mesh, points=3.0 * face.mesh.points + [0.0, 0.2, 0.1], normals=None)
    moved = replace(face, mesh=mesh)
    there = coordinates_on(moved, moved.neutral)
    assert on is not None and there is not None
    np.testing.assert_allclose(there.places, on.places, atol=1e-9)
    np.testing.assert_array_equal(there.slits, on.slits)
    assert there.unit == pytest.approx(3.0 * on.unit)


def test_a_face_without_known_lips_and_lids_has_none(face: BoundFace) -> None:
    assert coordinates_on(replace(face, layout=FaceLayout()), face.neutral) is None


def test_without_a_nose_tip_there_are_none(face: BoundFace) -> None:
    assert coordinates_on(replace(face, nose_tip=""), face.neutral) is None
