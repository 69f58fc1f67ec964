from pathlib import Path

import numpy as np
import pytest

from usdface.cli import main

CHECKOUT = Path(__file__).resolve().parents[1]


@pytest.fixture
def checkout(monkeypatch: pytest.MonkeyPatch) -> None:
    """As `python -m benchmarks.solve` finds its modules."""
    monkeypatch.syspath_prepend(str(CHECKOUT))


@pytest.mark.slow
@pytest.mark.usefixtures("checkout")
def test_ours_is_best_where_noise_is_all_there_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """A second of the example's curves, in one world."""
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


@pytest.mark.usefixtures("checkout")
def test_the_table_of_the_solve_has_a_row_a_world(capsys: pytest.CaptureFixture[str]) -> None:
    from benchmarks.solve.__main__ import print_table

    ours = {"weight rms": 0.01, "roughness / true": 0.9, "mesh mm": 0.1, "marker mm": 0.1}
    row = {"world": "noise 0.3 mm", "best": "ours", "solvers": {"ours": ours}}
    print_table({"curves": "made up", "quick": True, "rows": [row]})
    assert "noise 0.3 mm" in capsys.readouterr().out


@pytest.mark.usefixtures("checkout")
def test_a_folder_without_the_data_is_refused(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    from benchmarks.solve.__main__ import main as benchmark

    monkeypatch.setattr("sys.argv", ["benchmarks.solve", "--data", str(tmp_path)])
    with pytest.raises(SystemExit, match="no range-of-motion curves"):
        benchmark()


@pytest.mark.parametrize("options", [(), ("--quick",)])
def test_the_released_command_names_the_script(
    capsys: pytest.CaptureFixture[str], options: tuple[str, ...]
) -> None:
    assert main(["bench", "solve", *options]) == 1
    error = capsys.readouterr().err
    assert "python -m benchmarks.solve" in error and error.count("\n") == 1
