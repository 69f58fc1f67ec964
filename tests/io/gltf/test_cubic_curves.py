import numpy as np
import pytest

from usdface.errors import InputError
from usdface.io.gltf.cubic_curves import sampled_hermite
from usdface.io.gltf.reference_player.deformed_mesh import Sampled


def curve(seed: int, count: int = 6) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    times = np.sort(rng.choice(5000, count, replace=False)).astype(np.float32) / 1000
    return times.astype(float), rng.normal(size=(count, 3, 3))


def lines_at(moments, times, values) -> np.ndarray:
    return np.stack([np.interp(moments, times, column) for column in values.T], 1)


@pytest.mark.parametrize("tolerance", [1e-3, 1e-5])
def test_lines_are_within_the_tolerance_and_meet_the_keys(tolerance: float) -> None:
    times, keys = curve(0)
    moments, values, (found,) = sampled_hermite(times, keys, tolerance, "a")
    many = np.linspace(times[0], times[-1], 100_001)
    off = np.abs(lines_at(many, moments, values) - Sampled(times, keys, "CUBICSPLINE").at(many))
    assert 0.3 * tolerance < off.max() <= found.values["error"] <= tolerance
    assert np.isin(times, moments).all()
    np.testing.assert_array_equal(values[np.isin(moments, times)], keys[:, 1])


def test_times_are_floats_of_32_bits() -> None:
    """So that values are those of the curve at the times that are stored."""
    times, keys = curve(1)
    times = (times + 256).astype(np.float32).astype(float)
    moments, values, _ = sampled_hermite(times, keys, 1e-5, "a")
    np.testing.assert_array_equal(moments, moments.astype(np.float32))
    assert (np.diff(moments) > 0).all()
    shown = Sampled(times, keys, "CUBICSPLINE").at(moments)
    np.testing.assert_allclose(values, shown, atol=1e-9)


def test_curves_with_other_keys_are_sampled_at_the_same_times() -> None:
    """One animation has the times of all its curves: not as many as they have together."""
    alone = [sampled_hermite(*curve(seed), 1e-5, "a")[0] for seed in range(8)]
    together = np.unique(np.concatenate(alone))
    assert len(together) < 0.55 * sum(len(moments) for moments in alone)


def test_a_straight_line_needs_no_more_keys() -> None:
    keys = np.zeros((3, 3, 1))
    keys[:, :, 0] = [[1, 0, 1], [1, 1, 1], [1, 3, 1]]
    moments, _, _ = sampled_hermite(np.array([0.0, 1.0, 3.0]), keys, 1e-5, "a")
    np.testing.assert_array_equal(moments, [0, 1, 3])


def test_too_many_numbers_are_refused_before_they_are_made() -> None:
    wild = np.full((1000, 3, 500), 1e30)
    with pytest.raises(InputError, match="unfolds"):
        sampled_hermite(np.arange(1000.0), wild, 1e-5, "a")
