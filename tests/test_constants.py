"""The tables of docs/constants.md name constants that are there, each once, with its value."""

import re
from dataclasses import fields
from fractions import Fraction
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

TABLES = Path(__file__).resolve().parents[1] / "docs" / "constants.md"
# Modules in the first cell, names of constants (or of fields with a default) in the second, values
# in the third.
ROW = re.compile(
    r"^\| ((?:`[\w.]+`(?:, )?)+) \| ((?:`[\w.]+`[,;]? ?)+) \| ([^|]*?) ?\|", re.MULTILINE
)
ROWS = [
    (re.findall(r"`([\w.]+)`", modules), re.findall(r"`([\w.]+)`", names), value)
    for modules, names, value in ROW.findall(TABLES.read_text(encoding="utf-8"))
]
NUMBER = re.compile(r"(?<![\w.])-?\d+(?:/\d+|[.\d]*(?:e-?\d+)?)")


def found(modules: list[str], name: str) -> list[Any]:
    """The constants of that name, one for each module that has it."""
    kind, _, part = name.rpartition(".")
    loaded = [import_module(f"usdface.{module}") for module in modules]
    if not kind:
        return [getattr(module, name) for module in loaded if hasattr(module, name)]
    return [
        field.default
        for module in loaded
        for field in fields(getattr(module, kind))
        if field.name == part
    ]


def numbers(constant: Any) -> list[float]:
    values = list(constant.values()) if isinstance(constant, dict) else constant
    return [float(number) for number in np.ravel(values)]


def test_each_is_in_a_module_of_its_row() -> None:
    missing = [
        (modules, name) for modules, names, _ in ROWS for name in names if not found(modules, name)
    ]
    assert missing == []


def test_each_has_one_row() -> None:
    rows = [(*modules, name) for modules, names, _ in ROWS for name in names]
    assert len(rows) > 400
    assert len(set(rows)) == len(rows)


def test_values_are_those_of_the_code() -> None:
    wrong = []
    for modules, names, shown in ROWS:
        if not shown or "list" in shown or "grid" in shown:  # more than a cell has room for
            continue
        constants = [constant for name in names for constant in found(modules, name)]
        values = [number for constant in constants for number in numbers(constant)]
        if [float(Fraction(text)) for text in NUMBER.findall(shown)] != pytest.approx(values):
            wrong.append((names, shown, values))
    assert wrong == []
