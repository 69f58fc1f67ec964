"""The table of face motion: what other faces do is said for the markers of this one."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from faces import make_face

from usdface.face.bound_face import BoundFace
from usdface.face.expression_poses import composed_pose
from usdface.face.face_motion import face_motion, motion_at
from usdface.face.layout import FaceLayout


@pytest.fixture(scope="module")
def face() -> BoundFace:
    return make_face("example", Path()).bound


def test_every_rig_moves_every_place() -> None:
    table = face_motion()
    assert len(table.rigs) == 4 and len(table.places) == len(table.slits) > 40
    assert (table.places[:, 0] >= 0).all()
    for units in table.rigs.values():
        assert {1, 2, 4, 5, 9, 12, 15, 20, 26, 43} <= units.keys()
        for moved in units.values():
            assert moved.shape == (len(table.places), 3)
            assert np.abs(moved).max() < 1.0


def test_a_face_of_the_table_finds_its_own_motion(face: BoundFace) -> None:
    """Between the places and on markers of its own; a smile, raised brows, an open jaw."""
    moved = motion_at(face, rigs=("example",))
    assert moved is not None and list(moved) == ["example"]
    names = face.shape_names
    for unit, least in ((1, 0.8), (12, 0.9), (26, 0.95)):
        pose = composed_pose({unit: 1.0}, names)
        assert pose is not None
        own = face.displacements(pose.pose(names)[None])[0]
        known = moved["example"][unit]
        own, known = own - own[face.nose], known - known[face.nose]
        assert (own * known).sum() > least * np.linalg.norm(own) * np.linalg.norm(known)
        assert np.linalg.norm(known) == pytest.approx(np.linalg.norm(own), rel=0.3)


def test_left_and_right_are_mirror_images(face: BoundFace) -> None:
    moved = motion_at(face)
    assert moved is not None
    left, right = (face.markers.index(f"lip_corner_{side}") for side in ("left", "right"))
    for units in moved.values():
        np.testing.assert_allclose(units[12][left], units[12][right] * [-1, 1, 1], atol=0.002)
        assert units[12][left][0] > 0 and units[12][left][1] > 0


def test_nothing_is_known_without_lips_and_lids(face: BoundFace) -> None:
    assert motion_at(replace(face, layout=FaceLayout())) is None


def test_rounding_does_not_decide_the_side_of_the_midline(face: BoundFace) -> None:
    """Markers on it move straight up, down or forward."""
    moved = motion_at(face)
    assert moved is not None
    on_midline = np.abs(face.neutral[:, 0] - face.midline) < 1e-6
    assert on_midline.sum() >= 3
    for units in moved.values():
        for displaced in units.values():
            np.testing.assert_allclose(displaced[on_midline, 0], 0.0, atol=1e-8)
