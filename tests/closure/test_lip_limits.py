"""How far lips may be open, on distances known to the millimetre."""

import numpy as np
import pytest

from usdface.arrays import FloatArray
from usdface.closure.lip_limits import largest_apertures
from usdface.closure.lip_signal import LipDistances

TOLERANCE = 0.0005


def limits(
    seen: FloatArray,
    shown: FloatArray,
    opened: FloatArray,
    *,
    noise: float = 1e-5,
    misfit: float = 0.0,
) -> FloatArray:
    times = np.arange(len(seen)) / 60
    distances = LipDistances(seen, shown, noise)
    return largest_apertures(distances, opened, TOLERANCE, times, misfit=misfit)


def test_only_markers_that_contradict_the_solve_count() -> None:
    apart = np.array([[0.0, 0.001, 0.004]])
    opened = apart + 0.003
    assert np.isinf(limits(apart, apart, opened)).all()
    sure = limits(apart, apart + 0.003, opened)[0]
    assert sure[0] == TOLERANCE
    assert (np.diff(sure) > 0).all() and sure[2] > 0.01
    assert np.isinf(limits(apart, apart + 0.003, opened, noise=0.002)).all()


def test_a_contradiction_counts_from_where_lips_part_to_where_they_meet() -> None:
    opened = 0.004 * np.clip(np.sin(np.linspace(0, 4 * np.pi, 241)), 0, None)[:, None]
    seen, shown = np.zeros((241, 1)), np.zeros((241, 1))
    shown[25:35] = 0.003
    limited = np.minimum(limits(seen, shown, opened), opened)[:, 0]
    assert (limited[:100] <= TOLERANCE).all()
    np.testing.assert_array_equal(limited[120:], opened[120:, 0])
    # No pop: nowhere faster than the lips as solved.
    assert np.abs(np.diff(limited)).max() <= np.abs(np.diff(opened[:, 0])).max()


def test_lips_that_the_markers_show_apart_open_within_a_contact() -> None:
    seen, shown = np.zeros((240, 1)), np.full((240, 1), 0.003)
    seen[60:72] = shown[60:72] = 0.009
    limited = limits(seen, shown, np.full((240, 1), 0.009))[:, 0]
    assert (limited[60:72] > 0.03).all() and (limited[:50] == TOLERANCE).all()


def rolled_open() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return markers as near as at rest, that agree with the solve, and lips that open by 5 mm.

    Later both part by 9 mm.
    """
    opened = 0.005 * np.clip(np.sin(np.linspace(0, 2 * np.pi, 241)), 0, None)[:, None]
    seen = np.zeros((241, 1))
    seen[160:] = 0.009
    opened[160:] = 0.012
    return seen, seen.copy(), opened


def test_lips_that_roll_open_where_the_performers_touch_are_limited_on_another_face() -> None:
    seen, shown, opened = rolled_open()
    limited = limits(seen, shown, opened, misfit=0.0007)[:, 0]
    assert (limited[:160] == TOLERANCE).all() and (limited[160:] > opened.max()).all()


def test_lips_are_trusted_as_solved_where_the_rig_explains_the_markers() -> None:
    seen, shown, opened = rolled_open()
    assert np.isinf(limits(seen, shown, opened, misfit=0.0002)).all()


def test_the_rig_is_trusted_less_by_degrees() -> None:
    seen, shown, opened = rolled_open()
    misfits = np.linspace(0.00026, 0.0006, 8)
    least = [limits(seen, shown, opened, misfit=misfit)[0, 0] for misfit in misfits]
    assert (np.diff(least[:-1]) <= 0).all() and least[-1] == TOLERANCE


@pytest.mark.parametrize("size", [0.1, 100.0])
def test_faces_of_any_size_are_limited_alike(size: float) -> None:
    seen, shown, opened = rolled_open()
    times = np.arange(len(seen)) / 60
    distances = LipDistances(size * seen, size * shown, size * 1e-5)
    own = largest_apertures(distances, size * opened, size * TOLERANCE, times, misfit=size * 0.0004)
    np.testing.assert_allclose(own, size * limits(seen, shown, opened, misfit=0.0004))
