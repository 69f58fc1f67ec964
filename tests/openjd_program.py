"""The reference implementation of Open Job Description, which some tests run."""

import subprocess
from pathlib import Path

import pytest

__all__ = ["openjd"]

ROOT = Path(__file__).parents[1]


def openjd(*arguments: object) -> str:
    """Run the reference implementation; it has an environment of its own (.ci/run)."""
    program = ROOT / ".venv-openjd/bin/openjd"
    if not program.is_file():
        pytest.skip("openjd-cli is missing: see .ci/run")
    command = [str(argument) for argument in (program, *arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout
