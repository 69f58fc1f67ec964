"""The course of closings: once up, once down."""

import numpy as np

from usdface.closure.eye_closing import EyeClosing, closing_course, nearest_frame


def test_the_course_rises_and_falls_once_and_is_smooth() -> None:
    times = np.arange(0, 4, 1 / 120)
    blinks = [
        EyeClosing("blink", (0, 1), start, start + 0.05, start + 0.1, start + 0.3, 1.0)
        for start in (1.0, 2.5)
    ]
    course = closing_course(times, blinks)[:, 0]
    for each in blinks:
        own = course[(times > each.start - 0.1) & (times < each.end + 0.1)]
        top = int(own.argmax())
        assert own[top] == 1.0
        assert (np.diff(own[: top + 1]) >= 0).all() and (np.diff(own[top:]) <= 0).all()
    # The closing takes 50 ms: a raised cosine's slope there.
    assert np.abs(np.diff(course)).max() <= np.pi / 2 / 0.05 / 120 + 1e-9


def test_a_wink_is_the_course_of_one_eye_and_overlaps_take_the_larger() -> None:
    times = np.arange(0, 2, 1 / 60)
    wink = EyeClosing("held", (1,), 0.2, 0.4, 1.0, 1.4, 1.0)
    both = EyeClosing("blink", (0, 1), 0.9, 1.0, 1.05, 1.2, 1.0)
    one, two = closing_course(times, [wink]), closing_course(times, [both])
    assert not one[:, 0].any() and one[:, 1].max() == 1.0
    assert np.array_equal(closing_course(times, [wink, both]), np.maximum(one, two))


def test_the_nearest_frame_is_the_earlier_of_two() -> None:
    times = np.array([0.0, 1.0, 2.0])
    assert [nearest_frame(times, t) for t in (-1.0, 0.4, 0.5, 0.6, 2.0, 9.0)] == [0, 0, 0, 1, 2, 2]
