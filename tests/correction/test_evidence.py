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
    np.testing.assert_allclose(evidence.determination, [1, 1, 1, 0], atol=0.03)


def missing(evidence: Evidence, weights: np.ndarray, pose: np.ndarray) -> tuple[str, ...]:
    """Return the regions that do not match a pose, and check that the others match it whole."""
    found = {
        region: float(match[0]) for region, match in evidence.match(weights[None], pose).items()
    }
    assert set(found.values()) <= {0.0, 1.0}
    return tuple(region for region, match in found.items() if match == 0)


def participation(
    evidence: Evidence, weights: np.ndarray, pose: np.ndarray, size: float, by_rules: float = 1.0
) -> list:
    sizes, shares = np.array([size]), np.array([by_rules])
    return evidence.participation(weights[None], pose, sizes, shares)[0].tolist()


def test_half_the_pose_matches_it(evidence):
    assert missing(evidence, 0.5 * POSE, POSE) == ()


def test_frowning_brows_over_a_mouth_at_rest_are_no_anger(evidence):
    assert missing(evidence, np.array([0.9, 0.0, 0.0, 0.0]), POSE) == ("mouth",)


def test_a_pucker_is_no_pressed_mouth(evidence):
    assert missing(evidence, np.array([0.9, 0.4, 0.6, 0.0]), POSE) == ("mouth",)


def test_a_pose_asks_only_for_the_regions_that_it_moves(evidence):
    assert missing(evidence, np.array([0.0, 0.5, 0.0, 0.0]), POSE * [0, 1, 0, 1]) == ()


def test_blend_shapes_that_rest_take_no_part_unless_unseen(evidence):
    solved = np.array([0.5, 0.02, 0.0, 0.0])
    assert participation(evidence, solved, POSE, 0.5) == [True, False, False, True]
    # Likeness alone does not say which undetermined blend shapes take part.
    assert participation(evidence, solved, POSE, 0.5, by_rules=0.0) == [True, False, False, False]


def two_of_a_kind(other: float) -> Evidence:
    """Markers that hardly tell two shapes of the mouth apart; the second moves by `other`."""
    basis = np.zeros((2, 3, 3))
    basis[0, 1], basis[1, 1] = 0.002, [0.002, 0.002, other]
    face = marker_face(tuple("nab"), np.eye(3), basis, ("pull", "stretch"), "n")
    regions = {"mouth": ("pull", "stretch")}
    return evidence_of(
        replace(face, layout=FaceLayout(regions=regions)), ("pull", "stretch"), EVIDENCE
    )


def test_a_shape_explained_by_a_similar_one_is_not_missing():
    solved, pose = np.array([[0.36, 0.3]]), np.array([1.0, 0.0])
    alike, other = (
        float(two_of_a_kind(z).match(solved, pose)["mouth"][0]) for z in (0.0021, -0.008)
    )
    assert alike > 0.8 and other < 0.4


def test_a_part_at_rest_does_not_make_a_broad_smile_small():
    basis = np.zeros((2, 3, 3))
    basis[0, 1], basis[1, 2] = 0.01, 0.002  # the cheeks are seen, but not well
    names = ("smile", "cheeks")
    face = marker_face(tuple("nab"), np.eye(3), basis, names, "n")
    evidence = evidence_of(face, names, EVIDENCE)
    broad, slight = np.array([0.8, 0.0]), np.array([0.15, 0.0])
    assert participation(evidence, broad, np.ones(2), 0.3) == [True, False]
    assert participation(evidence, slight, np.ones(2), 0.15) == [True, True]


def test_shapes_of_no_marker_are_believed():
    loose = evidence_of(marker_face(), ("smile",), EVIDENCE)
    assert loose.determination.tolist() == [0.0]
    assert missing(loose, np.zeros(1), np.ones(1)) == ()
    assert participation(loose, np.zeros(1), np.ones(1), 0.3) == [1.0]


def test_without_evidence_the_rules_decide(evidence):
    rules_alone = replace(evidence, least=0.0)
    assert missing(rules_alone, np.zeros(4), POSE) == ()
    assert participation(rules_alone, np.zeros(4), POSE, 0.5) == (POSE > 0).tolist()


def test_the_evidence_is_a_continuous_function_of_the_weights(evidence):
    there = np.linspace(0, 1, 2001)[:, None] * [0.9, 0.0, 0.0, 0.0] + [0.0, 0.5, 0.3, 0.2]
    match = evidence.match(there[:, [1, 0, 2, 3]], POSE)
    assert np.ptp(match["mouth"]) == 1
    for share in (
        *match.values(),
        evidence.participation(there, POSE, np.full(2001, 0.5), np.ones(2001)),
    ):
        assert np.abs(np.diff(share, axis=0)).max() < 0.02


@pytest.mark.parametrize(("least", "expected"), [(0.05, [0.0, 1.0]), (0.95, [0.0, 1.0])])
def test_an_exact_pose_matches_whole_and_another_not_at_any_level(evidence, least, expected):
    poses = np.array([POSE * [1, 0, 0, 0] + [0, 0, 1, 0], POSE])
    found = replace(evidence, least=least).match(poses, POSE)["mouth"]
    np.testing.assert_allclose(found, expected, atol=1e-6)


def test_mixtures_that_markers_cannot_tell_apart_are_alike():
    """A jaw that is solved half as lips that roll: each of the two is clearly seen by itself."""
    basis = np.zeros((3, 3, 3))
    basis[0, 1], basis[1, 1], basis[2, 2] = [0, -0.02, 0.0001], [0, -0.02, 0], [0.02, 0, 0]
    names = ("jaw", "roll", "smile")
    face = marker_face(tuple("nab"), np.eye(3), basis, names, "n")
    layout = FaceLayout(regions={"mouth": names})
    evidence = evidence_of(replace(face, layout=layout), names, EVIDENCE)
    pose, split = np.array([1.0, 0.0, 0.4]), np.array([[0.5, 0.5, 0.4]])
    assert evidence.match(split, pose)["mouth"][0] == 1.0
    assert evidence.match(np.array([[0.0, 0.0, 0.4]]), pose)["mouth"][0] == 0.0
