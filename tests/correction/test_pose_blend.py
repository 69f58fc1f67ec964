import numpy as np
import pytest

from usdface.correction.pose_blend import correct, ease_antagonists, respond
from usdface.errors import InputError
from usdface.options import RESPONSE

RNG = np.random.default_rng(4)
F, E, S = 40, 3, 7
WEIGHTS = RNG.uniform(size=(F, S))
EMOTIONS = RNG.uniform(size=(F, E)) * (RNG.uniform(size=(F, E)) > 0.4)
POSES = RNG.uniform(size=(E, S)) * (RNG.uniform(size=(E, S)) > 0.5)
GAINS = np.array([1.0, 0.5, 1.4])
MODES = ("raise", "add")


def test_both_formulas_by_hand():
    weights = np.array([[0.2, 0.9, 0.5]])
    emotions = np.array([[0.5, 1.0]])
    poses = np.array([[1.0, 1.0, 0.0], [0.4, 0.0, 0.0]])
    gains = np.array([1.0, 2.0])
    raised = correct(weights, emotions, poses, gains, "raise", 0.5, (0.0, 1.0))
    np.testing.assert_allclose(raised, [[0.4, 0.9, 0.5]])
    added = correct(weights, emotions, poses, gains, "add", 0.5)
    np.testing.assert_allclose(added, [[0.2 + 0.25 + 0.4, 1.0, 0.5]])


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("gain", [0.0, 0.3, 1.0, 5.0])
def test_weights_stay_between_0_and_1_and_are_never_lowered(mode, gain):
    corrected = correct(WEIGHTS, EMOTIONS, POSES, GAINS, mode, gain)
    assert corrected.min() >= 0 and corrected.max() <= 1
    assert (corrected >= WEIGHTS).all()
    assert (corrected > WEIGHTS).any() == (gain > 0)


def test_raising_twice_is_raising_once():
    once = correct(WEIGHTS, EMOTIONS, POSES, GAINS)
    np.testing.assert_array_equal(correct(once, EMOTIONS, POSES, GAINS), once)


def test_raise_does_not_push_a_face_that_already_shows_the_expression():
    raised = respond(EMOTIONS[:, :1], RESPONSE) * POSES[0]
    alone = EMOTIONS * [1, 0, 0]
    np.testing.assert_array_equal(correct(raised, alone, POSES, np.ones(E)), raised)
    assert (correct(raised, alone, POSES, np.ones(E), "add") > raised).any()


@pytest.mark.parametrize("mode", MODES)
def test_no_emotion_changes_nothing(mode):
    corrected = correct(WEIGHTS, np.zeros((F, E)), POSES, GAINS, mode)
    np.testing.assert_array_equal(corrected, WEIGHTS)


@pytest.mark.parametrize("mode", MODES)
def test_the_order_of_emotions_does_not_matter(mode):
    p = [2, 0, 1]
    np.testing.assert_allclose(
        correct(WEIGHTS, EMOTIONS[:, p], POSES[p], GAINS[p], mode),
        correct(WEIGHTS, EMOTIONS, POSES, GAINS, mode),
        atol=1e-15,
    )


@pytest.mark.parametrize("mode", MODES)
def test_more_emotion_is_never_less_weight(mode):
    less = correct(WEIGHTS, 0.7 * EMOTIONS, POSES, GAINS, mode)
    assert (correct(WEIGHTS, EMOTIONS, POSES, GAINS, mode) >= less).all()


def test_shapes_that_no_expression_moves_are_left_alone():
    poses = POSES.copy()
    poses[:, 3] = 0
    np.testing.assert_array_equal(correct(WEIGHTS, EMOTIONS, poses, GAINS)[:, 3], WEIGHTS[:, 3])


def test_the_input_is_not_touched():
    weights = WEIGHTS.copy()
    correct(weights, EMOTIONS, POSES, GAINS, "add")
    np.testing.assert_array_equal(weights, WEIGHTS)


def test_what_does_not_fit_is_refused():
    with pytest.raises(InputError, match="do not fit"):
        correct(WEIGHTS, EMOTIONS[:-1], POSES, GAINS)
    with pytest.raises(InputError, match="gains"):
        correct(WEIGHTS, EMOTIONS, POSES, GAINS[:-1])
    with pytest.raises(InputError, match="mode"):
        correct(WEIGHTS, EMOTIONS, POSES, GAINS, "lower")


def test_half_an_expression_is_answered_by_all_of_it_and_a_trace_by_nothing():
    onset, full = RESPONSE
    grid = np.linspace(0, 1, 201)
    answer = respond(grid, RESPONSE)
    assert not answer[grid <= onset].any() and (answer[grid >= full] == 1).all()
    assert (np.diff(answer) >= 0).all()
    assert respond(np.array([(onset + full) / 2]), RESPONSE) == pytest.approx(0.5)
    # It begins and ends level: no pop, no kink.
    assert np.abs(np.diff(answer, 2)).max() < 0.004


def test_a_weak_expression_comes_at_least_half_way_to_the_whole():
    pose = np.array([[1.0, 0.6, 0.0]])
    amounts = np.linspace(0.4, 0.7, 7)[:, None]
    weak = amounts * pose
    # The outputs of a real solve fall short by up to 0.05.
    corrected = correct(weak, amounts - 0.05, pose, np.ones(1))
    before, after = (np.linalg.norm(w - pose, axis=1) for w in (weak, corrected))
    assert (after <= 0.5 * before).all()


@pytest.mark.parametrize("mode", MODES)
def test_gains_over_time_are_those_of_each_frame(mode):
    gains, gain = RNG.uniform(0, 2, size=(F, E)), RNG.uniform(size=F)
    whole = correct(WEIGHTS, EMOTIONS, POSES, gains, mode, gain)
    for f in range(F):
        row = slice(f, f + 1)
        alone = correct(WEIGHTS[row], EMOTIONS[row], POSES, gains[f], mode, float(gain[f]))
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
def test_raising_and_easing_twice_is_doing_it_once(ease):
    names = tuple("abcdefg")
    pairs = [("a", "b"), ("c", "d"), ("a", "e")]
    raised = correct(np.zeros(WEIGHTS.shape), EMOTIONS, POSES, GAINS)

    def once(weights):
        return correct(
            ease_antagonists(weights, raised, names, pairs, ease), EMOTIONS, POSES, GAINS
        )

    first = once(WEIGHTS)
    np.testing.assert_array_equal(once(first), first)
    assert (first < WEIGHTS).any() == (ease > 0)
