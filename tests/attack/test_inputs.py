"""Spoilt files for every reader and command, a few of those of `inputs.py`."""

from pathlib import Path

import pytest
from attack.inputs import Verdicts, attack, make_seeds


@pytest.mark.slow
def test_spoilt_files(tmp_path: Path) -> None:
    (tmp_path / "seeds").mkdir()
    verdicts = Verdicts()
    for seed in make_seeds(tmp_path / "seeds"):
        attack(seed, range(40), tmp_path, verdicts)
    assert not verdicts.faults
