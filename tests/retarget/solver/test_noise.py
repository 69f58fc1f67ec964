import numpy as np
import pytest

from usdface.retarget.solver.noise import white_noise


def test_white_noise_skips_gaps() -> None:
    values = 1e-3 * np.random.default_rng(14).normal(size=(2000, 3))
    values[::9] = np.nan
    assert white_noise(values) == pytest.approx(1e-3, rel=0.05)
