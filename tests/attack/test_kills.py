"""Kills at random moments, a few of those of `kills.py`."""

import random
from pathlib import Path

import pytest
from attack.kills import Report, kill, make_commands, run_pairs


@pytest.mark.slow
def test_kills(tmp_path: Path) -> None:
    report, rng = Report(), random.Random(0)
    commands = make_commands(tmp_path)
    for k in range(64):
        kill(commands[k % len(commands)], rng, report)
    for command in commands:
        run_pairs(command, report)
    assert not report.faults
