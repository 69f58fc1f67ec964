"""The keys of findings as docs/reports.md has them.

`conftest.py` compares every finding that a test makes with them.
"""

import re
from collections import defaultdict
from functools import cache
from pathlib import Path
from typing import Any

__all__ = ["documented_keys", "undocumented"]

PAGE = Path(__file__).parents[1] / "docs" / "reports.md"
UNITS = "mm|m|km|um|s|hz|percent|degrees|mib|px"
CLOCK = {"time_s", "times_s", "start_s", "end_s"}


@cache
def _rows() -> list[tuple[str, str]]:
    return re.findall(r"^\| `(\w+)` \| (.*) \|$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)


@cache
def documented_keys() -> dict[str, set[str]]:
    """The keys of each code."""
    table: dict[str, set[str]] = defaultdict(set)
    table |= {name: set(re.findall(r"`(\w+)`", text)) for name, text in _rows() if name.isupper()}
    return table


def undocumented(code: str, values: dict[str, Any]) -> list[str]:
    """Keys that their code does not have, and values of another kind than their key says."""
    described = {name: text for name, text in _rows() if name.islower()}
    wrong = [key for key in values if key not in documented_keys()[code] | CLOCK]
    for key, value in values.items():
        if key.endswith("_count"):
            fits = isinstance(value, int)
        elif key == "times_s" or re.search(f"_({UNITS})$", key):
            fits = value is None or isinstance(value, float | int | list)
        else:
            fits = key in described and not (
                described[key].startswith("integer") and not isinstance(value, int)
            )
        wrong += [] if fits else [f"{key} = {value!r}"]
    return wrong
