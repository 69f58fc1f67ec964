import numpy as np

from usdface.footage.follow import HIDDEN
from usdface.footage.join_tracks import without_lone_samples


def column(*stretches: tuple[int, int], frames: int = 60) -> np.ndarray:
    """One track's dots, 7 within the stretches (first, last)."""
    dots = np.full((frames, 1), HIDDEN)
    for first, last in stretches:
        dots[first : last + 1] = 7
    return dots


def test_a_spot_that_shows_for_an_image_is_no_return_of_a_dot() -> None:
    table = column((0, 19), (29, 29), (45, 48))
    assert np.array_equal(without_lone_samples(table, 5), column((0, 19)))


def test_a_dot_that_returns_for_five_images_is_kept() -> None:
    table = column((0, 19), (29, 33))
    assert np.array_equal(without_lone_samples(table, 5), table)


def test_gaps_of_two_images_do_not_end_a_stretch() -> None:
    table = column((0, 0), (2, 2), (5, 5), (8, 9))
    assert np.array_equal(without_lone_samples(table, 40), table)


def test_the_reference_frame_keeps_its_dots() -> None:
    table = column((0, 19), (29, 29))
    assert np.array_equal(without_lone_samples(table, 29), table)


def test_a_track_that_never_lasts_is_left_to_the_count_of_its_images() -> None:
    table = column((10, 10), (29, 29))
    assert np.array_equal(without_lone_samples(table, 0), table)


def test_a_spot_that_flickers_long_after_the_dot_is_no_return_of_it() -> None:
    flicker = [(30, 30), (32, 32), (34, 36), (39, 39), (41, 42), (44, 45)]
    table = column((0, 19), *flicker)
    assert np.array_equal(without_lone_samples(table, 5), column((0, 19)))


def test_a_dot_that_flickers_where_it_was_is_kept() -> None:
    table = column((0, 19), (23, 23), (25, 25), (27, 28), (30, 30))
    assert np.array_equal(without_lone_samples(table, 5), table)


def test_a_dot_may_return_again_and_again() -> None:
    table = column((0, 5), (20, 26), (40, 44))
    assert np.array_equal(without_lone_samples(table, 2), table)
