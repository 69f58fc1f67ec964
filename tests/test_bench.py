from pathlib import Path

import numpy as np
import pytest

import usdface.bench
from usdface.cli import main
from usdface.errors import InputError


def test_ours_is_best_where_noise_is_all_there_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """A second of the example's curves, in one world."""
    monkeypatch.syspath_prepend(str(usdface.bench.CHECKOUT))
    from benchmarks.solve import table, worlds
    from benchmarks.solve.faces import example

    world = worlds.perform("noise", example(), part=slice(60, 180))
    monkeypatch.setattr(table, "worlds", lambda data, quick: iter([world]))
    (row,) = table.measured(Path("nowhere"), quick=True)["rows"]
    assert row["best"] == "ours"
    found = row["solvers"]
    assert set(found) == {"ours", *table.BASELINES}
    assert all(np.isfinite(list(figures.values())).all() for figures in found.values())
    assert found["ours"]["outside bounds"] == 0.0
    assert found["exact"]["weight rms"] <= found["least squares, clipped"]["weight rms"]


def test_a_folder_without_the_data_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no range-of-motion curves"):
        usdface.bench.solve_table(tmp_path)


def test_outside_a_checkout_one_line_says_what_is_needed(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(usdface.bench, "CHECKOUT", tmp_path)
    assert main(["bench", "solve"]) == 1
    assert "needs a checkout" in capsys.readouterr().err
