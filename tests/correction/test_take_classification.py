"""Classification of a take: markers as they were recorded, smoothed, and mirrored for each half."""

from types import SimpleNamespace

import numpy as np
import pytest
from marker_face import marker_face

from usdface.correction.expression_classifier import Classification
from usdface.correction.features import smooth
from usdface.correction.take_classification import classify_take, recorded_motion
from usdface.face.bound_face import BoundFace

NEUTRAL = np.array([[0, 0, 0], [30, 30, 0], [-30, 30, 0], [25, -30, 0], [-25, -30, 0]]) * 0.001
MARKERS = ("nose", "brow_left", "brow_right", "lip_left", "lip_right")
TIMES = np.arange(40) / 30
MIRROR = np.array([-1, 1, 1])


@pytest.fixture(scope="module")
def face() -> BoundFace:
    return marker_face(MARKERS, NEUTRAL, np.full((1, 5, 3), 0.001), ("jawOpen",), "nose")


def solution(markers: tuple[str, ...]) -> tuple[SimpleNamespace, np.ndarray]:
    moved = 0.01 * np.random.default_rng(0).standard_normal((len(TIMES), len(markers), 3))
    return SimpleNamespace(markers=markers, displaced=lambda frames: moved[frames]), moved


def test_markers_go_by_name_and_those_that_were_not_used_stay_at_rest(face: BoundFace) -> None:
    solved, moved = solution(("lip_left", "nose", "brow_right"))
    found = recorded_motion(face, solved, ["both"], times=TIMES, width=0.0)(slice(5, 9))
    expected = np.zeros((4, 5, 3))
    expected[:, [3, 0, 2]] = moved[5:9]
    np.testing.assert_array_equal(found["both"], expected)


@pytest.mark.parametrize("width", [0.0, 0.1])
def test_halves_are_smoothed_as_the_whole_face(face: BoundFace, width: float) -> None:
    solved, moved = solution(MARKERS)
    motion = recorded_motion(face, solved, ["both", "left", "right"], times=TIMES, width=width)
    blocks = [motion(block) for block in (slice(0, 17), slice(17, 40))]
    whole, left, right = (np.concatenate([b[s] for b in blocks]) for s in ("both", "left", "right"))
    flat = smooth(moved.reshape(40, -1), TIMES, width)
    np.testing.assert_allclose(whole, flat.reshape(moved.shape), atol=1e-15)
    np.testing.assert_allclose(left[:, [1, 3]], whole[:, [1, 3]], atol=1e-15)
    np.testing.assert_allclose(left[:, [2, 4]], whole[:, [1, 3]] * MIRROR, atol=1e-15)
    np.testing.assert_allclose(right[:, [1, 3]], whole[:, [2, 4]] * MIRROR, atol=1e-15)
    assert not left[:, 0, 0].any()  # the nose stays on the midline


def test_each_side_has_its_own_classifier() -> None:
    """Two classifiers that say how large the motion is, of three expressions."""

    def classifier(scale: float) -> SimpleNamespace:
        def classify(moved: np.ndarray) -> Classification:
            size = scale * moved[:, 0, :]
            return Classification(size, 2 * size, 3 * size)

        return SimpleNamespace(classify=classify)

    course = np.random.default_rng(0).random((40, 1, 3))
    classifiers = {"both": classifier(1.0), "left": classifier(10.0)}
    found = classify_take(classifiers, lambda f: dict.fromkeys(classifiers, course[f]), 40)
    assert list(found) == ["both", "left"]
    for side, scale in (("both", 1.0), ("left", 10.0)):
        np.testing.assert_allclose(found[side].confidence, scale * course[:, 0])
        np.testing.assert_allclose(found[side].amplitude, 2 * scale * course[:, 0])
        np.testing.assert_allclose(found[side].contradiction, 3 * scale * course[:, 0])
