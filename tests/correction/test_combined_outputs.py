"""Rules and classifier together: who raises an output, and who suppresses it."""

import numpy as np

from usdface.correction.combined_outputs import combined_outputs
from usdface.correction.expression_classifier import Classification


def classification(
    size: np.ndarray, contrary: np.ndarray, confidence: float = 1.0
) -> Classification:
    return Classification(np.full(size.shape, confidence), size, contrary)


def test_a_classification_raises_its_emotion_and_suppresses_the_rules_of_others() -> None:
    rules = np.array([[0.9, 0.1], [0.1, 0.6], [0.0, 0.0]])
    sizes, contrary = np.zeros((2, 3, 2))
    sizes[:2, 0], contrary[1, 1] = (0.9, 0.3), 1
    given = classification(sizes, contrary)
    found = combined_outputs(rules, given, np.ones(2), np.array([0.9, 0]))
    np.testing.assert_allclose(found, [[0.9, 0.1], [0.3, 0], [0, 0]])
    suppressed = combined_outputs(rules, given, np.zeros(2), np.array([0.9, 0]))
    np.testing.assert_allclose(suppressed, [[0.9, 0.1], [0.1, 0], [0, 0]])
    alone = combined_outputs(rules, given, np.zeros(2), np.array([0.9, 0]), suppression=0.0)
    np.testing.assert_allclose(alone, rules)


def test_a_performer_who_shows_less_is_scaled_up_in_proportion() -> None:
    course = np.linspace(0, 0.3, 7)[:, None]
    given = classification(course, np.zeros((7, 1)))
    found = combined_outputs(np.zeros((7, 1)), given, np.ones(1), np.array([0.3]))
    np.testing.assert_allclose(found[:, 0], np.linspace(0, 0.45, 7))
    little = classification(course / 10, np.zeros((7, 1)))
    faint = combined_outputs(np.zeros((7, 1)), little, np.ones(1), np.array([0.03]))
    np.testing.assert_allclose(faint[:, 0], np.linspace(0, 0.06, 7))


def test_a_weak_performer_gets_no_more_confidence() -> None:
    doubtful = classification(np.full((3, 1), 0.9), np.zeros((3, 1)), confidence=0.2)
    found = combined_outputs(np.zeros((3, 1)), doubtful, np.ones(1), doubtful.detected.max(axis=0))
    np.testing.assert_allclose(found, 0.2)
