"""Kills at random moments, a few of those of `kills.py`."""

import subprocess
import sys
from pathlib import Path

import pytest
from checkout import environment

PROGRAM = Path(__file__).with_name("kills.py")


@pytest.mark.slow
def test_kills() -> None:
    # A process of its own: it forks, before which USD must have no threads.
    options = ["--kills", "64", "--pairs", "6"]
    ended = subprocess.run(
        [sys.executable, PROGRAM, *options], env=environment(), capture_output=True, text=True
    )
    assert ended.returncode == 0, ended.stdout + ended.stderr
