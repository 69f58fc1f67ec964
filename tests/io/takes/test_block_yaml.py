"""The YAML of calibration programs."""

from pathlib import Path

import pytest

from usdface.errors import InputError
from usdface.io.takes.block_yaml import parse_block_yaml

FILE = Path("rig.yml")


def test_brackets_over_many_lines_are_one_value() -> None:
    text = 'size: [\n  640, # width\n  480\n]\n"K 1" : {a: 1,\n  b: [2, 3]}\n'
    assert parse_block_yaml(FILE, text) == {"size": [640, 480], "K 1": {"a": 1, "b": [2, 3]}}


def test_a_long_line_is_gone_through_once() -> None:
    """Where it were tried from each of its blanks, this would not end."""
    with pytest.raises(InputError, match="line 1: 'a  "):
        parse_block_yaml(FILE, "a" + " " * 2**22 + "b")
