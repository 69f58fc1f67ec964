"""Variants of an expression are detected, motion that is as near to another emotion is not."""

from dataclasses import replace

import numpy as np
import pytest
from marker_face import marker_face

from usdface.correction.expression_classifier import ExpressionClassifier
from usdface.face.bound_face import BoundFace
from usdface.face.expression_poses import expressions_for

# Marker (0 nose, 1 to 4 brows and lids, 5 to 8 mouth) and direction of each blend shape [m].
MOVES = {
    "browInnerUp": {1: (0, 8, 0), 2: (0, 3, 0)},
    "browOuterUpLeft": {2: (0, 8, 0)},
    "browOuterUpRight": {3: (0, 8, 0)},
    "browDownLeft": {1: (-3, -7, 0), 2: (0, -4, 0)},
    "browDownRight": {3: (3, -7, 0)},
    "eyeWideLeft": {4: (0, 3, 0)},
    "eyeWideRight": {4: (0, 3, 0)},
    "cheekSquintLeft": {4: (0, 2, 2)},
    "cheekSquintRight": {4: (0, 2, 2)},
    "noseSneerLeft": {7: (0, 6, 0), 1: (0, -3, 0)},
    "noseSneerRight": {7: (0, 6, 0), 3: (0, -3, 0)},
    "mouthSmileLeft": {5: (8, 9, -6)},
    "mouthSmileRight": {6: (-8, 9, -6)},
    "mouthFrownLeft": {5: (2, -8, 0)},
    "mouthFrownRight": {6: (-2, -8, 0)},
    "mouthStretchLeft": {5: (9, -3, -4)},
    "mouthStretchRight": {6: (-9, -3, -4)},
    "mouthPressLeft": {8: (0, 5, 2)},
    "mouthPressRight": {8: (0, 5, 2)},
    "mouthLowerDownLeft": {8: (0, -6, 1)},
    "mouthLowerDownRight": {8: (0, -6, 1)},
    "jawOpen": {8: (0, -25, -10), 5: (0, -5, 0), 6: (0, -5, 0)},
}
NAMES = tuple(MOVES)
EMOTIONS = ("joy", "sadness", "anger", "fear", "disgust", "surprise")


@pytest.fixture(scope="module")
def face() -> BoundFace:
    basis = np.zeros((len(MOVES), 9, 3))
    for row, moved in enumerate(MOVES.values()):
        for marker, offset in moved.items():
            basis[row, marker] = 0.001 * np.array(offset)
    places = [(0, 0), (10, 30), (30, 32), (-20, 31), (20, 20), (25, -30), (-25, -30), (0, -20)]
    neutral = np.array([*places, (0, -40)]) * 0.001
    return marker_face(tuple("nabcdefgh"), np.c_[neutral, np.zeros(9)], basis, NAMES, "n")


@pytest.fixture(scope="module")
def classifier(face: BoundFace) -> ExpressionClassifier:
    return ExpressionClassifier(face, expressions_for(NAMES)[0])


def moved(face: BoundFace, **weights: float) -> np.ndarray:
    row = [max((w for part, w in weights.items() if n.startswith(part)), default=0) for n in NAMES]
    return face.displacements(np.array([row], dtype=float))


def detected_by(classifier: ExpressionClassifier, motion: np.ndarray) -> dict[str, float]:
    return dict(zip(EMOTIONS, classifier.classify(motion).detected[0], strict=True))


def test_every_pose_is_detected_at_its_amplitude(
    face: BoundFace, classifier: ExpressionClassifier
) -> None:
    poses = np.array([e.pose(NAMES) for e in expressions_for(NAMES)[0]])
    for amount in (0.2, 0.5, 1.0):
        found = classifier.classify(face.displacements(amount * poses))
        own = np.diag(found.detected)
        for e, emotion in enumerate(EMOTIONS):
            assert abs(found.amplitude[e, e] - amount) < 1e-9, emotion
            if amount == 1.0 and emotion not in ("fear", "surprise"):
                assert own[e] > 0.35, emotion
            assert own[e] < amount + 1e-9
        assert (found.detected - np.diag(own)).max() < 0.01
        assert np.diag(found.contradiction).max() == 0


def test_raised_brows_over_an_open_mouth_are_surprise_and_fear_with_stretched_lips(
    face: BoundFace, classifier: ExpressionClassifier
) -> None:
    surprise = {"browInnerUp": 0.8, "browOuterUp": 0.6, "eyeWide": 0.8, "jawOpen": 0.3}
    fear = surprise | {"browOuterUp": 0.3, "mouthStretch": 0.8}
    for emotion, units in (("surprise", surprise), ("fear", fear)):
        found = detected_by(classifier, moved(face, **units))
        assert found.pop(emotion) > 0.35
        assert max(found.values()) == 0


def test_a_variant_in_other_directions_is_detected(
    face: BoundFace, classifier: ExpressionClassifier
) -> None:
    smile = moved(face, mouthSmile=0.7, jawOpen=0.1)
    turned = smile * [0.7, 1.3, 0.6]
    found = detected_by(classifier, turned)
    assert found["joy"] > 0.35 and max(v for n, v in found.items() if n != "joy") == 0


def test_speech_and_motion_as_near_to_another_emotion_are_not_detected(
    face: BoundFace, classifier: ExpressionClassifier
) -> None:
    for motion in (
        moved(face, jawOpen=0.6),
        moved(face, jawOpen=0.3, mouthLowerDown=0.4),
        moved(face, browDown=0.8),
        moved(face, browDown=0.8, mouthSmile=0.3),
    ):
        assert max(detected_by(classifier, motion).values()) < 0.35


def test_noise_on_a_still_face_is_not_detected(
    face: BoundFace, classifier: ExpressionClassifier
) -> None:
    jitter = 0.0002 * np.random.default_rng(0).standard_normal((400, 9, 3))
    assert classifier.classify(jitter).detected.max() < 0.05


def test_it_is_a_continuous_function_of_the_markers(
    face: BoundFace, classifier: ExpressionClassifier
) -> None:
    rng = np.random.default_rng(0)
    motions = face.displacements(rng.uniform(0, 0.6, size=(200, len(NAMES))))
    near = motions + 1e-7 * rng.standard_normal(motions.shape)
    for one, two in zip(_both(classifier, motions), _both(classifier, near), strict=True):
        assert np.abs(one - two).max() < 1e-3


def _both(classifier: ExpressionClassifier, motions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    found = classifier.classify(motions)
    return found.detected, found.contradiction


@pytest.mark.parametrize("markers", [1, 9])
def test_markers_that_no_blend_shape_moves_show_no_emotion(face: BoundFace, markers: int) -> None:
    still = marker_face(
        face.markers[:markers],
        face.neutral[:markers],
        np.zeros((len(NAMES), markers, 3)),
        NAMES,
        "n",
    )
    motion = 0.005 * np.random.default_rng(0).standard_normal((4, markers, 3))
    found = ExpressionClassifier(still, expressions_for(NAMES)[0]).classify(motion)
    assert not found.detected.any()


def test_the_order_of_the_blend_shapes_does_not_matter(
    face: BoundFace, classifier: ExpressionClassifier
) -> None:
    mesh = replace(face.mesh, shapes=face.mesh.shapes[::-1])
    other = ExpressionClassifier(replace(face, mesh=mesh), expressions_for(NAMES)[0])
    poses = np.array([e.pose(NAMES) for e in expressions_for(NAMES)[0]])
    more = 0.4 * np.random.default_rng(0).random((60, len(NAMES)))
    motion = face.displacements(np.tile(poses, (10, 1)) + more)
    for name in ("confidence", "amplitude", "contradiction"):
        expected = getattr(classifier.classify(motion), name)
        np.testing.assert_allclose(getattr(other.classify(motion), name), expected, atol=1e-9)
        assert expected.max() > 0.0
