import pytest

from usdface.cli.bench_tables import print_solve_table, print_tables
from usdface.papers import tables


def test_tables_of_papers_have_every_figure(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    computed = tables()
    monkeypatch.setenv("COLUMNS", "30")
    print_tables(computed)
    text = capsys.readouterr().out
    for table in computed:
        assert table.title.split()[0] in text
        assert all(f"|{figure:.3f}" in text for figure in table.computed.ravel())
    assert text.count("(kept)") == len(computed)


def test_the_table_of_the_solve_has_a_row_a_world(capsys: pytest.CaptureFixture[str]) -> None:
    ours = {"weight rms": 0.01, "roughness / true": 0.9, "mesh mm": 0.1, "marker mm": 0.1}
    row = {"world": "noise 0.3 mm", "best": "ours", "solvers": {"ours": ours}}
    made = {"curves": "made up", "quick": True, "rows": [row]}
    print_solve_table(made)
    assert "noise 0.3 mm" in capsys.readouterr().out
