"""The picture of the house is drawn from the contract that the imports keep."""

import re
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[1] / "docs"


def test_the_picture_is_that_of_the_contract(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(DOCS)
    import make_house

    drawn = (DOCS / "house.svg").read_text(encoding="utf-8")
    assert drawn == make_house.picture(), "python docs/make_house.py draws it anew"


def test_every_module_that_the_page_names_is_there() -> None:
    text = (DOCS / "architecture.md").read_text(encoding="utf-8").split("## Letters and words")[0]
    package = DOCS.parent / "usdface"
    files = {path.name for path in package.rglob("*.py")}
    for name in re.findall(r"`([\w/]+\.py)`", text):
        there = (DOCS.parent / name, package / name)
        assert any(path.is_file() for path in there) or name in files, name
    for name in re.findall(r"`([\w/]+)/`", text):
        assert (package / name).is_dir() or (package / "io" / name).is_dir(), name
