"""Eyes that are held closed, from the share of the blinks' level that they reach."""

import numpy as np

from usdface.arrays import FloatArray
from usdface.closure.eye_closing import closing_course
from usdface.closure.held_eyes import find_held_eyes

TIMES = np.arange(0, 6, 1 / 60)
LEVEL = np.array([2.0, 0.5])
WHOLE = np.ones((len(TIMES), 2), dtype=bool)


def shut(first: float, last: float, dip: float = 0.0) -> FloatArray:
    """Closed from `first` to `last` [s] with 0.2 s on either side, and a dip in the middle."""
    held = np.clip(np.minimum(TIMES - first, last - TIMES) / 0.2 + 1, 0, 1)
    return held - dip * np.exp(-(((TIMES - 0.5 * (first + last)) / 0.15) ** 2))


def test_both_eyes_are_closed_at_their_own_level() -> None:
    found = find_held_eyes(TIMES, shut(2.0, 4.0)[:, None] * LEVEL, LEVEL, WHOLE)
    assert [each.eyes for each in found] == [(0,), (1,)]
    for each in found:
        assert each.kind == "held" and each.height == 1.0
        assert each.start < each.closed < each.opened < each.end
        assert abs(each.closed - 2.0) < 0.05 and abs(each.opened - 4.0) < 0.05


def test_a_squint_at_half_the_level_is_open() -> None:
    assert not find_held_eyes(TIMES, 0.6 * shut(2.0, 4.0)[:, None] * LEVEL, LEVEL, WHOLE)


def test_eyes_that_narrow_together_close_together() -> None:
    """Not the one that is a little ahead; one that the other contradicts closes alone."""
    narrow = shut(2.0, 4.0)[:, None] * LEVEL
    for left, right, eyes in (
        (0.76, 0.81, []),
        (0.78, 0.83, [(0,), (1,)]),
        (0.95, 0.75, [(0,), (1,)]),
        (0.95, 0.7, [(0,)]),
        (0.83, 0.7, []),
    ):
        found = find_held_eyes(TIMES, [left, right] * narrow, LEVEL, WHOLE)
        assert [each.eyes for each in found] == eyes
        if len(eyes) == 2:
            course = closing_course(TIMES, found)
            assert (course[(TIMES > 2.1) & (TIMES < 3.9)] > 0.9).all()


def test_an_eye_that_opens_halfway_between_is_closed_twice() -> None:
    for dip, count in ((0.25, 1), (0.5, 2)):
        found = find_held_eyes(TIMES, shut(1.5, 4.5, dip)[:, None] * LEVEL, LEVEL, WHOLE)
        assert [each.eyes for each in found] == [(0,)] * count + [(1,)] * count


def test_in_between_lids_open_by_degrees() -> None:
    """A dip to 0.75 of the blinks' level is half of the way from closed, 0.8, to open, 0.7."""
    (held,) = find_held_eyes(TIMES, shut(1.5, 4.5, 0.25)[:, None] * LEVEL, LEVEL, WHOLE)[:1]
    course = closing_course(TIMES, [held])[:, 0]
    assert abs(course[180] - 0.5) < 1e-9
    assert (course[(TIMES > 1.6) & (TIMES < 2.7)] == 1.0).all()
    assert (np.diff(course[100:180]) <= 0).all() and (np.diff(course[180:260]) >= 0).all()


def test_skin_alone_closes_no_eye_and_an_eye_that_is_not_seen_contradicts_none() -> None:
    closing = shut(2.0, 4.0)[:, None] * LEVEL
    assert not find_held_eyes(TIMES, closing, LEVEL, ~WHOLE)
    closing[:, 1] = np.nan
    assert [each.eyes for each in find_held_eyes(TIMES, closing, LEVEL, WHOLE)] == [(0,)]


def test_the_shortest_held_eye_is_found_wherever_it_is_in_the_take() -> None:
    """Four frames at 30 Hz last a tenth of a second, give or take the last bit of their times."""
    times = np.arange(120) / 30.0
    for first in range(5, 110):
        closing = np.zeros((120, 2))
        closing[first : first + 4] = LEVEL
        whole = np.ones((120, 2), dtype=bool)
        assert len(find_held_eyes(times, closing, LEVEL, whole)) == 2
