from pathlib import Path

import pytest
from fit_world import RULES, make_examples

from usdface.errors import InputError
from usdface.figures.fit import write_fit_figure
from usdface.fuzzy.fit.learned import fit_system
from usdface.fuzzy.fit.validation import cross_validate


def test_the_same_system_gives_the_same_picture(tmp_path: Path) -> None:
    examples = make_examples({("joy", ""): RULES["joy", ""]}, takes=2)
    system, _ = fit_system(examples)
    tested = cross_validate(examples, "recording")
    one, other = tmp_path / "one.svg", tmp_path / "other.svg"
    write_fit_figure(system, tested, one)
    write_fit_figure(system, tested, other)
    assert one.read_bytes() == other.read_bytes()


def test_no_picture_of_another_kind(tmp_path: Path) -> None:
    system, _ = fit_system(make_examples())
    with pytest.raises(InputError, match="is no picture"):
        write_fit_figure(system, None, tmp_path / "fit.txt")
