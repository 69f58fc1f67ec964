from pathlib import Path

import numpy as np
import pytest
from fit_world import RULES, make_examples

from usdface.errors import InputError
from usdface.figures.fit import write_fit_figure
from usdface.rule_learning.cross_validation import Validation, cross_validate
from usdface.rule_learning.learned_system import fit_system


@pytest.mark.slow
def test_the_same_system_gives_the_same_picture(tmp_path: Path) -> None:
    examples = make_examples({("joy", ""): RULES["joy", ""]}, takes=2)
    system = fit_system(examples).system
    tested = cross_validate(examples, "recording")
    one, other = tmp_path / "one.svg", tmp_path / "other.svg"
    write_fit_figure(system, tested, one)
    write_fit_figure(system, tested, other)
    assert one.read_bytes() == other.read_bytes()


@pytest.mark.slow
def test_only_what_was_tested_has_a_row(tmp_path: Path) -> None:
    system = fit_system(make_examples()).system
    counts = np.array([[2, 1, 0], [0, 0, 0], [0, 0, 3]])
    tested = Validation("variant", ("joy", "fear"), counts, np.zeros(0), ())
    write_fit_figure(system, tested, tmp_path / "fit.svg")
    text = (tmp_path / "fit.svg").read_text()
    # Once as heard, and once as shown where it was.
    assert [text.count(f"<!-- {name} -->") for name in ("joy", "fear", "none")] == [2, 1, 2]
    assert "5 of 6 correct (1 of 3 emotions without a test)" in text


def test_no_picture_of_another_kind(tmp_path: Path) -> None:
    system = fit_system(make_examples()).system
    with pytest.raises(InputError, match="is no picture"):
        write_fit_figure(system, None, tmp_path / "fit.txt")
