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


def test_shapes_of_no_marker_are_believed():
    loose = evidence_of(marker_face(), ("smile",), EVIDENCE)
    assert loose.seen.tolist() == [0.0]
    assert loose.missing(np.zeros(1), np.ones(1)) == ()
    assert loose.takes_part(np.zeros(1), np.ones(1), 0.3).all()


def test_without_evidence_the_rules_decide(evidence):
    rules_alone = replace(evidence, least=0.0)
    assert rules_alone.missing(np.zeros(4), POSE) == ()
    assert rules_alone.takes_part(np.zeros(4), POSE, 0.5).tolist() == (POSE > 0).tolist()
