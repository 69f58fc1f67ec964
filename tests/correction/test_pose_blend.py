import numpy as np
import pytest

from usdface.correction.pose_blend import add_poses, ease_antagonists, respond
from usdface.options import RESPONSE

RNG = np.random.default_rng(4)
F, E, S = 40, 3, 7
WEIGHTS = RNG.uniform(size=(F, S))
EMOTIONS = RNG.uniform(size=(F, E)) * (RNG.uniform(size=(F, E)) > 0.4)
POSES = RNG.uniform(size=(E, S)) * (RNG.uniform(size=(E, S)) > 0.5)
GAINS = np.array([1.0, 0.5, 1.4])


def added(weights, emotions, poses=POSES, gains=GAINS, gain=1.0):
    return add_poses(weights, emotions, poses, gains, gain)


def test_the_formula_by_hand():
    weights = np.array([[0.2, 0.9, 0.5]])
    emotions = np.array([[0.5, 1.0]])
    poses = np.array([[1.0, 1.0, 0.0], [0.4, 0.0, 0.0]])
    corrected = added(weights, emotions, poses, np.array([1.0, 2.0]), 0.5)
    np.testing.assert_allclose(corrected, [[0.2 + 0.25 + 0.4, 1.0, 0.5]])


@pytest.mark.parametrize("gain", [0.0, 0.3, 1.0, 5.0])
def test_weights_stay_between_0_and_1_and_are_never_lowered(gain):
    corrected = added(WEIGHTS, EMOTIONS, gain=gain)
    assert corrected.min() >= 0 and corrected.max() <= 1
    assert (corrected >= WEIGHTS).all()
    assert (corrected > WEIGHTS).any() == (gain > 0)


def test_no_emotion_changes_nothing():
    corrected = added(WEIGHTS, np.zeros((F, E)))
    np.testing.assert_array_equal(corrected, WEIGHTS)


def test_the_order_of_emotions_does_not_matter():
    p = [2, 0, 1]
    np.testing.assert_allclose(
        added(WEIGHTS, EMOTIONS[:, p], POSES[p], GAINS[p]),
        added(WEIGHTS, EMOTIONS),
        atol=1e-15,
    )


def test_more_emotion_is_never_less_weight():
    less = added(WEIGHTS, 0.7 * EMOTIONS)
    assert (added(WEIGHTS, EMOTIONS) >= less).all()


def test_shapes_that_no_expression_moves_are_left_alone():
    poses = POSES.copy()
    poses[:, 3] = 0
    np.testing.assert_array_equal(added(WEIGHTS, EMOTIONS, poses)[:, 3], WEIGHTS[:, 3])


def test_the_input_is_not_touched():
    weights = WEIGHTS.copy()
    added(weights, EMOTIONS)
    np.testing.assert_array_equal(weights, WEIGHTS)


def test_half_an_expression_is_answered_by_all_of_it_and_a_trace_by_nothing():
    onset, full = RESPONSE
    grid = np.linspace(0, 1, 201)
    answer = respond(grid, RESPONSE)
    assert not answer[grid <= onset].any() and (answer[grid >= full] == 1).all()
    assert (np.diff(answer) >= 0).all()
    assert respond(np.array([(onset + full) / 2]), RESPONSE) == pytest.approx(0.5)
    # It begins and ends level: no pop, no kink.
    assert np.abs(np.diff(answer, 2)).max() < 0.004


def test_gains_over_time_are_those_of_each_frame():
    gains, gain = RNG.uniform(0, 2, size=(F, E)), RNG.uniform(size=F)
    whole = added(WEIGHTS, EMOTIONS, POSES, gains, gain)
    for f in range(F):
        row = slice(f, f + 1)
        alone = added(WEIGHTS[row], EMOTIONS[row], POSES, gains[f], float(gain[f]))
        np.testing.assert_array_equal(whole[row], alone)


def test_what_is_raised_leaves_its_antagonist_the_rest():
    names = ("smile", "frown", "jaw")
    weights = np.array([[0.2, 0.7, 0.9], [0.2, 0.1, 0.9]])
    raised = np.array([[0.8, 0.0, 0.0], [0.8, 0.0, 0.0]])
    pairs = [("frown", "smile"), ("smile", "wink")]
    for amount, frowns in ((1.0, (0.2, 0.1)), (0.5, (0.6, 0.1)), (0.0, (0.7, 0.1))):
        expected = weights.copy()
        expected[:, 1] = frowns
        np.testing.assert_allclose(
            ease_antagonists(weights, raised, names, pairs, amount), expected
        )


@pytest.mark.parametrize("ease", [0.0, 0.4, 1.0])
def test_easing_twice_is_easing_once(ease):
    names = tuple("abcdefg")
    pairs = [("a", "b"), ("c", "d"), ("a", "e")]
    raised = added(np.zeros(WEIGHTS.shape), EMOTIONS)
    first = ease_antagonists(WEIGHTS, raised, names, pairs, ease)
    np.testing.assert_array_equal(ease_antagonists(first, raised, names, pairs, ease), first)
    assert (first < WEIGHTS).any() == (ease > 0)
