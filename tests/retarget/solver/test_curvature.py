import numpy as np
import pytest
from bands import dense

from usdface.retarget.solver.curvature import curvature_bands

RNG = np.random.default_rng(6)


@pytest.mark.parametrize("times", [np.arange(9) / 30, np.cumsum(RNG.uniform(0.01, 0.1, 9))])
def test_straight_lines_have_no_curvature(times: np.ndarray) -> None:
    matrix = dense(curvature_bands(times))
    np.testing.assert_allclose(matrix @ (3 + 2 * times), 0.0, atol=1e-6 * np.abs(matrix).max())
    assert np.linalg.eigvalsh(matrix)[0] > -1e-9 * np.abs(matrix).max()


def test_curvature_is_the_integral_at_any_frame_rate() -> None:
    """The integral of (w'')^2 of w = t^3 over [0, 1] is 12; the ends are not counted."""
    for count in (200, 400, 800):
        times = np.linspace(0, 1, count)
        wave = times**3
        value = wave @ dense(curvature_bands(times)) @ wave
        assert value == pytest.approx(12.0, rel=4.0 / count)


def test_one_and_two_frames_have_no_curvature() -> None:
    assert not curvature_bands(np.array([0.0])).any()
    assert not curvature_bands(np.array([0.0, 1.0])).any()
