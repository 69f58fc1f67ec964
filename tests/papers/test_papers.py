import numpy as np
import pytest

from usdface.cli import main
from usdface.papers import fuzzy_table, rbf_table


def test_every_coordinate_of_the_rbf_papers_table_is_met() -> None:
    """33 points, 3 axes, all within the two-decimal rounding of the print."""
    table = rbf_table()
    assert table.published.shape == (33, 3) and table.legible == 99
    assert np.abs(table.computed - table.published).max() <= 0.01 and table.within


def test_every_output_of_the_fuzzy_paper_is_met() -> None:
    table = fuzzy_table()
    assert table.legible == 33
    assert table.rms <= 0.009 and table.largest <= 0.041 and table.within


def test_the_command_prints_both_tables(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "papers"]) == 0
    printed = capsys.readouterr().out
    assert "RBF space map" in printed and "Fuzzy corrector" in printed and "kept" in printed
    assert "NOT KEPT" not in printed
