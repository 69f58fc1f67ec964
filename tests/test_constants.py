"""The tables of docs/constants.md name constants that are there, each once."""

import re
from importlib import import_module
from pathlib import Path

TABLES = Path(__file__).resolve().parents[1] / "docs" / "constants.md"
# Modules in the first cell, names of constants in the second.
ROW = re.compile(r"^\| ((?:`[\w.]+`(?:, )?)+) \| ((?:`\w+`[,;]? ?)+) \|", re.MULTILINE)
ROWS = [
    (re.findall(r"`([\w.]+)`", modules), re.findall(r"`(\w+)`", names))
    for modules, names in ROW.findall(TABLES.read_text(encoding="utf-8"))
]


def test_each_is_in_a_module_of_its_row() -> None:
    missing = [
        (modules, name)
        for modules, names in ROWS
        for name in names
        if not any(hasattr(import_module(f"usdface.{module}"), name) for module in modules)
    ]
    assert missing == []


def test_each_has_one_row() -> None:
    rows = [(*modules, name) for modules, names in ROWS for name in names]
    assert len(rows) > 400
    assert len(set(rows)) == len(rows)
