import numpy as np
import pytest

from usdface.retarget.noise import marker_misfit, marker_noise, unexplained


def test_the_noise_is_found_under_motion_and_misfit() -> None:
    """Known noise, a moving face, and a slow misfit ten times as large as the noise."""
    rng = np.random.default_rng(11)
    times = np.arange(600) / 60
    explained = rng.normal(size=(5, 40))
    motion = np.sin(times[:, None] * rng.uniform(1, 5, 5)) @ explained
    misfit = 1e-2 * np.sin(times[:, None] * 2.0) * rng.normal(size=40)
    observed = motion + misfit + 1e-3 * rng.normal(size=(600, 40))
    seen = np.ones(600, dtype=bool)
    assert marker_noise(observed @ unexplained(explained), seen) == pytest.approx(1e-3, rel=0.05)
    observed[::50] += 1.0  # spikes
    assert marker_noise(observed @ unexplained(explained), seen) == pytest.approx(1e-3, rel=0.15)


def test_noise_cannot_be_told_from_too_little() -> None:
    seen = np.ones(3, dtype=bool)
    assert marker_noise(np.zeros((3, 4)), seen) == 0.0
    assert marker_noise(np.zeros((9, 2)) @ unexplained(np.eye(2)), np.ones(9, dtype=bool)) == 0.0


def test_the_misfit_is_found_under_motion_rest_and_noise() -> None:
    """Rest has no misfit, an expression a lot, and a marker swapped now and then is none."""
    rng = np.random.default_rng(12)
    explained, rest = np.eye(60)[:5], np.eye(60)[5:]
    motion = rng.normal(size=(1000, 5)) @ explained
    direction = rng.normal(size=55)
    misfit = (direction / np.sqrt(np.mean(direction**2))) @ rest
    size = np.where(np.arange(1000) < 600, 0.0, 1e-2)[:, None]
    observed, seen = motion + size * misfit, np.ones(1000, dtype=bool)
    basis = unexplained(explained)
    assert marker_misfit(observed @ basis, seen, 0.0) == pytest.approx(1e-2)
    noise = 1e-3 * rng.normal(size=(1000, 60))
    assert marker_misfit((motion + noise) @ basis, seen, 1e-3) < 4e-4
    assert marker_misfit((observed + noise) @ basis, seen, 1e-3) == pytest.approx(1e-2, rel=0.05)
    observed[::50] += misfit
    assert marker_misfit(observed @ basis, seen, 0.0) == pytest.approx(1e-2)


def test_misfit_cannot_be_told_from_too_little() -> None:
    assert marker_misfit(np.ones((9, 0)), np.ones(9, dtype=bool), 0.0) == 0.0
