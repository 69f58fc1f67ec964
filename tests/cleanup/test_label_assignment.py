import numpy as np

from usdface.cleanup.label_assignment import assign_labels, cycles, last_visible

RNG = np.random.default_rng(8)
PLACES = 0.02 * np.stack(np.meshgrid(np.arange(4), np.arange(3)), -1).reshape(-1, 2)
TIME = np.arange(200)[:, None]
STILL = np.zeros((200, 12, 3))
STILL[..., :2] = PLACES
STILL += 0.004 * np.sin(0.1 * TIME[..., None] * RNG.uniform(0.5, 1, (12, 3)))
ALL = np.ones((200, 12), dtype=bool)
OWN = np.broadcast_to(np.arange(12), (200, 12))


def test_markers_that_keep_their_labels_are_their_own() -> None:
    np.testing.assert_array_equal(assign_labels(STILL, ALL, 0.02), OWN)


def test_three_labels_that_change_round_are_followed_until_they_change_back() -> None:
    truth = OWN.copy()
    truth[50:90][:, [1, 2, 6]] = [2, 6, 1]
    truth[120:121][:, [0, 11]] = [11, 0]
    given = np.take_along_axis(STILL, truth[..., None], axis=1)
    np.testing.assert_array_equal(assign_labels(given, ALL, 0.02), truth)


def test_the_label_of_most_frames_is_right() -> None:
    truth = OWN.copy()
    truth[:70][:, [3, 4]] = [4, 3]
    given = np.take_along_axis(STILL, truth[..., None], axis=1)
    np.testing.assert_array_equal(assign_labels(given, ALL, 0.02), truth)


def test_the_label_of_the_frames_that_are_named_right_is_right() -> None:
    truth = OWN.copy()
    truth[60:][:, [3, 4]] = [4, 3]
    given = np.take_along_axis(STILL, truth[..., None], axis=1)
    np.testing.assert_array_equal(assign_labels(given, ALL, 0.02, (0, 9)), truth)
    outside = assign_labels(given, ALL, 0.02, (190, 260))
    np.testing.assert_array_equal(outside, assign_labels(given, ALL, 0.02))


def test_markers_that_come_back_swapped_are_followed() -> None:
    truth, seen = OWN.copy(), ALL.copy()
    truth[100:130][:, [3, 4]] = [4, 3]
    seen[95:100, [3, 4]] = False
    given = np.take_along_axis(STILL, truth[..., None], axis=1)
    given[~seen] = np.nan
    np.testing.assert_array_equal(assign_labels(given, seen, 0.02), truth)


def test_labels_that_change_back_while_one_is_hidden_are_followed() -> None:
    """In a long take with gaps one swap that was never seen to end was believed to the end."""
    for swap, hidden in ((slice(50, 90), slice(85, 100)), (slice(95, 130), slice(80, 105))):
        truth, seen = OWN.copy(), ALL.copy()
        truth[swap, 3:5] = [4, 3]
        seen[hidden, 4] = False
        seen[150:170, 9] = False  # hidden, and the same as before when it comes back
        given = np.take_along_axis(STILL, truth[..., None], axis=1)
        given[~seen] = np.nan
        np.testing.assert_array_equal(assign_labels(given, seen, 0.02), truth)


def test_a_permutation_has_cycles_of_what_it_moves() -> None:
    assert cycles(np.array([0, 2, 1, 4, 5, 3])) == [[1, 2], [3, 4, 5]]


def test_two_spikes_at_once_are_no_swap() -> None:
    given = STILL.copy()
    given[60, [2, 9]] += [[0.0, 0.0, 0.03], [0.0, 0.0, -0.03]]
    np.testing.assert_array_equal(assign_labels(given, ALL, 0.02), OWN)


def test_the_last_visible_frame_is_the_frame_itself_where_it_is_visible() -> None:
    seen = np.array([[False], [True], [False], [False], [True]])
    np.testing.assert_array_equal(last_visible(seen)[:, 0], [0, 1, 1, 1, 4])
