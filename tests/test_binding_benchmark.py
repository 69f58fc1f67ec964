"""The performers of the benchmark of proposed places."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

CHECKOUT = Path(__file__).resolve().parents[1]


def test_a_random_bend_comes_with_its_jacobian(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(CHECKOUT))
    from benchmarks.solve.faces import random_bend

    around = 0.05 * np.random.default_rng(3).normal(size=(20, 3))
    points = around[:6]
    _, turn = random_bend(5, points, around, 0.004, 0.05)
    for axis, step in enumerate(1e-6 * np.eye(3)):
        ahead, _ = random_bend(5, points + step, around, 0.004, 0.05)
        behind, _ = random_bend(5, points - step, around, 0.004, 0.05)
        np.testing.assert_allclose(turn[:, :, axis], (ahead - behind) / 2e-6, atol=1e-8)


@pytest.mark.slow
def test_it_finds_its_modules_from_any_folder(tmp_path: Path) -> None:
    command = [sys.executable, str(CHECKOUT / "benchmarks" / "binding.py"), "--help"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
