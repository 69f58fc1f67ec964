import pytest

from usdface.cli.print_papers import print_papers
from usdface.papers import tables


def test_tables_of_papers_have_every_figure(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    computed = tables()
    monkeypatch.setenv("COLUMNS", "30")
    print_papers(computed)
    text = capsys.readouterr().out
    for table in computed:
        assert table.title.split()[0] in text
        assert all(f"|{figure:.3f}" in text for figure in table.computed.ravel())
    assert text.count("(kept)") == len(computed)
