"""The table: sorted by trouble, and as a page that is safe to open."""

from pathlib import Path

from usdface.show.page import table_page
from usdface.show.table import Row, by_trouble, row_from

ROWS = (
    Row(name="fine", verdict="good", residual_max_mm=9.0),
    Row(name="finer", verdict="good", residual_max_mm=1.0),
    Row(name="hm", verdict="look_at", residual_max_mm=2.0, reasons=("NOISE_LARGE",)),
    Row(name="bad", verdict="not_usable"),
    Row(name="gone", state="missing"),
    Row(name="<b>", state="failed", error="it </td> died", code="WORKER_DIED"),
)


def test_the_ones_in_most_trouble_come_first() -> None:
    names = [row.name for row in by_trouble(ROWS)]
    assert names == ["<b>", "gone", "bad", "hm", "fine", "finer"]


def test_rows_come_back_from_plain_values_and_nonsense_does_not() -> None:
    assert [row_from(row.as_dict()) for row in ROWS] == list(ROWS)
    assert row_from({}) is None
    for name in ROWS[0].as_dict():
        assert row_from(ROWS[0].as_dict() | {name: b"x"}) is None


def test_the_page_links_to_the_shots_and_escapes_their_words(tmp_path: Path) -> None:
    row = Row(name="a b", verdict="good", root=str(tmp_path / "s/a #1.usda"), residual_max_mm=1.25)
    page = table_page([*ROWS, row], "show & tell", tmp_path / "pages/show.html")
    assert 'href="../s/a%20%231.usda"' in page and "1.25" in page
    assert "&lt;b&gt;" in page and "<b>" not in page and "it &lt;/td&gt; died" in page
    assert "show &amp; tell" in page and "<script" not in page and "NOISE_LARGE" in page
