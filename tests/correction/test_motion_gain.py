"""Shown motion: the solve's direction, the markers' size."""

import numpy as np
import pytest

from usdface.correction.motion_gain import motion_gains, motion_products

UPPER = np.array([True, True, False, False])
ALL = np.ones(4, dtype=bool)


def gains_of(solved, recorded, measured, frames):
    """Return the gain of each marker: (F, M)."""
    products = motion_products(solved, recorded, UPPER, measured)
    return motion_gains(products, frames)[:, UPPER.astype(int)]


@pytest.fixture
def solved() -> np.ndarray:
    course = np.sin(np.linspace(0, np.pi, 60))[:, None, None]
    return course * np.random.default_rng(0).uniform(-0.01, 0.01, size=(4, 3))


def test_a_half_that_moves_further_than_solved_is_read_as_large_as_it_moves(solved):
    recorded = solved * np.where(UPPER, 1.0, 1.25)[:, None]
    gains = gains_of(solved, recorded, ALL, 0.0)
    np.testing.assert_allclose(gains[:, UPPER], 1.0)
    np.testing.assert_allclose(gains[30, ~UPPER], 1.25, atol=0.01)


def test_motion_that_the_rig_cannot_show_makes_nothing_larger(solved):
    across = np.cross(solved, [0.3, 0.5, -0.2])
    np.testing.assert_allclose(gains_of(solved, solved + across, ALL, 2.0), 1.0)


def test_noise_on_a_still_face_makes_nothing_larger():
    rng = np.random.default_rng(0)
    noisy = 0.0003 * rng.standard_normal((500, 4, 3))
    still = 0.1 * noisy + 0.00005 * rng.standard_normal((500, 4, 3))
    assert gains_of(still, noisy, ALL, 12.0).max() < 1.1


def test_a_gain_is_bounded_and_only_of_markers_that_count(solved):
    recorded = 9.0 * solved
    assert gains_of(solved, recorded, ALL, 0.0).max() == 1.5
    upper_alone = gains_of(solved, recorded, UPPER, 0.0)
    assert upper_alone[30, 0] == 1.5 and (upper_alone[:, ~UPPER] == 1).all()
