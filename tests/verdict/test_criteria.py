from pathlib import Path

import numpy as np

from usdface.errors import ERROR_CODES
from usdface.verdict import CRITERIA, Criterion

PAGE = Path(__file__).resolve().parents[2] / "docs" / "verdict.md"


def row(criterion: Criterion) -> str:
    """The row of a criterion in the table of the page."""

    def limit(value: float) -> str:
        if np.isinf(value):
            return "never"
        return f"{value:g} {criterion.unit}" if criterion.unit else f"{value:.0%}"

    says = criterion.subject.format(value="...", where="...")
    limits = f"{limit(criterion.look_at)} | {limit(criterion.not_usable)}"
    return f"| `{criterion.code}` | {says} | {limits} | {criterion.remedy} |"


def test_the_documented_table_is_the_table() -> None:
    lines = PAGE.read_text(encoding="utf-8").splitlines()
    assert [line for line in lines if line.startswith("| `")] == [row(c) for c in CRITERIA]


def test_a_criterion_has_a_code_of_its_own() -> None:
    """But for places that nobody is sure of: too many of them are an error."""
    codes = [criterion.code for criterion in CRITERIA]
    assert len({*codes}) == len(codes) and {*codes} & {*ERROR_CODES} == {"BINDING_UNSURE"}
