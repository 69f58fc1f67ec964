from pathlib import Path

import numpy as np
import pytest

from usdface.io.takes.origin_markers import (
    find_unseen,
    lone_origins,
    origin_markers,
    shared_origins,
)

RNG = np.random.default_rng(2)
FACE = 0.05 * RNG.normal(size=(20, 3))


def take(middle: tuple[float, float, float], unit: float = 1.0) -> np.ndarray:
    """A face that stands about `middle` and moves a little, its marker 4 at the origin."""
    positions = FACE + middle + 0.002 * RNG.normal(size=(50, 20, 3))
    positions[:, 4] = 0.0
    return unit * positions


@pytest.mark.parametrize("unit", [1.0, 1000.0])
def test_far_from_the_face_it_was_never_seen(unit: float) -> None:
    for middle in ((0, 1.6, 0), (0.3, 0.2, 0.4)):
        assert np.flatnonzero(origin_markers(take(middle, unit))).tolist() == [4]


def test_within_the_face_it_is_its_place() -> None:
    """As where all is measured from one marker, in the middle of the face or at its edge."""
    for marker in range(20):
        if marker != 4:
            assert not origin_markers(take(tuple(-FACE[marker]))).any()


def test_gaps_are_no_places() -> None:
    positions = take((0, 1.6, 0))
    positions[10:20] = np.nan
    positions[:, 7] = np.nan
    assert np.flatnonzero(origin_markers(positions)).tolist() == [4]


def test_what_leaves_the_origin_and_what_is_alone_are_kept() -> None:
    positions = take((0, 1.6, 0))
    positions[5, 4] = (0, 0, 1e-3)
    assert not origin_markers(positions).any()
    assert not origin_markers(take((0, 1.6, 0))[:, 3:6]).any()
    assert not origin_markers(np.zeros((5, 20, 3))).any()


def test_of_several_at_one_place_none_was_seen() -> None:
    positions = take((0, 0.1, 0))
    positions[:, 4] = FACE[4]
    positions[3, 4] = positions[8, 5] = 0  # alone in their frames
    positions[10:30, [2, 9]] = 0
    positions[40] = 0
    expected = np.zeros((50, 20), bool)
    expected[10:30, [2, 9]] = expected[40] = True
    np.testing.assert_array_equal(shared_origins(positions), expected)
    positions[10, 9] = np.nan
    assert not shared_origins(positions)[10].any()
    assert not shared_origins(np.zeros((5, 20, 3))).any()


@pytest.mark.parametrize("unit", [1.0, 1000.0])
def test_one_that_is_elsewhere_otherwise_was_not_seen_there(unit: float) -> None:
    positions = take((0, 0.3, 0), unit)
    positions[:, 4] = unit * (FACE[4] + (0, 0.3, 0))
    positions[3, 4] = positions[8:20, 5] = 0  # alone in their frames
    positions[30:, 6] = np.nan
    expected = np.zeros((50, 20), bool)
    expected[3, 4] = expected[8:20, 5] = True
    np.testing.assert_array_equal(lone_origins(positions), expected)
    unseen, found = find_unseen(Path("face.trc"), [f"m{m}" for m in range(20)], positions)
    np.testing.assert_array_equal(unseen, expected)
    assert [(each.code, each.values["place_count"]) for each in found] == [("MARKER_SPIKE", 13)]


def test_one_that_passes_the_origin_is_kept() -> None:
    """As a nose that is held there, written in whole millimetres."""
    positions = np.round(take(tuple(-FACE[4]), 1000.0))
    positions[:, 4] = np.round(RNG.normal(size=(50, 3)))
    positions[7, 4] = 0
    assert not lone_origins(positions).any()
    assert not lone_origins(take((0, 1.6, 0))).any()  # it has no other places
    assert not lone_origins(np.zeros((5, 20, 3))).any()


def test_one_that_starts_at_the_origin_and_goes_far_is_kept() -> None:
    """As the tip of a nose where the origin was set in the first frame, before the head moves."""
    positions = take(tuple(-FACE[4]))
    way = np.concatenate([np.zeros(10), np.linspace(0, 0.3, 20), np.full(20, 0.3)])
    positions[:, 4] = 0.0
    positions[..., 0] += way[:, None]
    assert not lone_origins(positions).any()
    positions[[35, 49], 4] = 0.0
    assert np.argwhere(lone_origins(positions)).tolist() == [[35, 4], [49, 4]]


def test_three_markers_do_not_show_where_the_face_is() -> None:
    positions = take((0, 1.6, 0))[:, 5:8]
    positions[3, 1] = 0
    assert not lone_origins(positions).any()
