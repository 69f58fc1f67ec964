"""Evidence: a region has to look like the pose, and a blend shape to take part in it."""

from dataclasses import replace

import numpy as np
import pytest
from marker_face import marker_face

from usdface.correction.evidence import Evidence, evidence_of
from usdface.face.layout import FaceLayout
from usdface.options import EVIDENCE

NAMES = ("browDown", "mouthPress", "mouthPucker", "eyeSquint")
POSE = np.array([1.0, 0.9, 0.0, 0.7])


@pytest.fixture
def evidence() -> Evidence:
    """Markers that see everything but the eyes."""
    basis = np.zeros((4, 5, 3))
    for shape in range(3):
        basis[shape, shape + 1] = 0.01
    face = marker_face(tuple("nabcd"), np.eye(5)[:, :3], basis, NAMES, "n")
    regions = {"brows": NAMES[:1], "mouth": NAMES[1:3], "eyes": NAMES[3:]}
    return evidence_of(replace(face, layout=FaceLayout(regions=regions)), NAMES, EVIDENCE)


def test_what_no_marker_sees_says_nothing(evidence):
    np.testing.assert_allclose(evidence.seen, [1, 1, 1, 0], atol=0.03)


def test_half_the_pose_shows_it(evidence):
    assert evidence.missing(0.5 * POSE, POSE) == ()


def test_frowning_brows_over_a_mouth_at_rest_are_no_anger(evidence):
    assert evidence.missing(np.array([0.9, 0.0, 0.0, 0.0]), POSE) == ("mouth",)


def test_a_pucker_is_no_pressed_mouth(evidence):
    assert evidence.missing(np.array([0.9, 0.4, 0.6, 0.0]), POSE) == ("mouth",)


def test_a_pose_asks_only_for_the_regions_that_it_moves(evidence):
    assert evidence.missing(np.array([0.0, 0.5, 0.0, 0.0]), POSE * [0, 1, 0, 1]) == ()


def test_blend_shapes_that_rest_take_no_part_unless_unseen(evidence):
    shown = np.array([0.5, 0.02, 0.0, 0.0])
    assert evidence.takes_part(shown, POSE, 0.5).tolist() == [True, False, False, True]


def two_of_a_kind(other: float) -> Evidence:
    """Markers that hardly tell two shapes of the mouth apart; the second moves by `other`."""
    basis = np.zeros((2, 3, 3))
    basis[0, 1], basis[1, 1] = 0.002, [0.002, 0.002, other]
    face = marker_face(tuple("nab"), np.eye(3), basis, ("pull", "stretch"), "n")
    regions = {"mouth": ("pull", "stretch")}
    return evidence_of(replace(face, layout=FaceLayout(regions=regions)), ("pull", "stretch"), 0.84)


def test_a_shape_explained_by_a_similar_one_is_not_missing():
    shown, pose = np.array([0.36, 0.3]), np.array([1.0, 0.0])
    assert two_of_a_kind(0.0021).missing(shown, pose) == ()
    assert two_of_a_kind(-0.008).missing(shown, pose) == ("mouth",)


def test_a_part_at_rest_does_not_make_a_broad_smile_small():
    basis = np.zeros((2, 3, 3))
    basis[0, 1], basis[1, 2] = 0.01, 0.002  # the cheeks are seen, but not well
    names = ("smile", "cheeks")
    face = marker_face(tuple("nab"), np.eye(3), basis, names, "n")
    evidence = evidence_of(face, names, 0.84)
    broad, slight = np.array([0.8, 0.0]), np.array([0.15, 0.0])
    assert evidence.takes_part(broad, np.ones(2), 0.3).tolist() == [True, False]
    assert evidence.takes_part(slight, np.ones(2), 0.15).tolist() == [True, True]


def test_shapes_of_no_marker_are_believed():
    loose = evidence_of(marker_face(), ("smile",), EVIDENCE)
    assert loose.seen.tolist() == [0.0]
    assert loose.missing(np.zeros(1), np.ones(1)) == ()
    assert loose.takes_part(np.zeros(1), np.ones(1), 0.3).all()


def test_without_evidence_the_rules_decide(evidence):
    rules_alone = replace(evidence, least=0.0)
    assert rules_alone.missing(np.zeros(4), POSE) == ()
    assert rules_alone.takes_part(np.zeros(4), POSE, 0.5).tolist() == (POSE > 0).tolist()
