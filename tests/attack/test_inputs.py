"""Spoilt files for every reader and command, a few of those of `inputs.py`."""

import subprocess
import sys
from pathlib import Path

import pytest
from checkout import environment

PROGRAM = Path(__file__).with_name("inputs.py")


@pytest.mark.slow
def test_spoilt_files() -> None:
    # A process of its own: it forks, before which USD must have no threads.
    options = ["--inputs", "1000", "--share", "0.05", "--seconds", "240"]
    ended = subprocess.run(
        [sys.executable, PROGRAM, *options], env=environment(), capture_output=True, text=True
    )
    assert ended.returncode == 0, ended.stdout + ended.stderr
