"""The keys of findings, and of the report of `process`, as docs/reports.md has them.

`conftest.py` compares every finding that a test makes with them.
"""

import re
from collections import defaultdict
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import Any

__all__ = ["documented_keys", "row_of", "undocumented", "undocumented_keys"]

PAGE = Path(__file__).parents[1] / "docs" / "reports.md"
UNITS = "mm|m|km|um|s|hz|percent|degrees|mib|px"
CLOCK = {"time_s", "times_s", "start_s", "end_s"}


@cache
def _rows() -> list[tuple[str, str]]:
    page = PAGE.read_text(encoding="utf-8")
    of_findings = page[page.index("\n## Findings\n") : page.index("\n## Verdict\n")]
    return re.findall(r"^\| `(\w+)` \| (.*) \|$", of_findings, re.MULTILINE)


@cache
def documented_keys() -> dict[str, set[str]]:
    """The keys of each code."""
    table: dict[str, set[str]] = defaultdict(set)
    table |= {name: set(re.findall(r"`(\w+)`", text)) for name, text in _rows() if name.isupper()}
    return table


def row_of(code: str, keys: Iterable[str]) -> str:
    """The row of a code in docs/reports.md."""
    return f"| `{code}` | {', '.join(f'`{key}`' for key in sorted(keys))} |"


def undocumented(code: str, values: dict[str, Any]) -> list[str]:
    """What docs/reports.md lacks of a finding: a row of its code, or of a key."""
    described = {name: text for name, text in _rows() if name.islower()}
    documented = documented_keys()[code]
    wrong = []
    if not values.keys() <= documented | CLOCK:
        wrong.append(f"in docs/reports.md write {row_of(code, documented | values.keys())}")
    for key, value in values.items():
        if key.endswith("_count"):
            fits = isinstance(value, int)
        elif key == "times_s" or re.search(f"_({UNITS})$", key):
            fits = value is None or isinstance(value, float | int | list)
        else:
            fits = key in described and not (
                described[key].startswith("integer") and not isinstance(value, int)
            )
        if not fits and re.search(f"_(count|{UNITS})$|^times_s$", key):
            wrong.append(f"{code}: {key} is {value!r}, which its ending denies")
        elif not fits and key in described:
            wrong.append(f"{code}: {key} is {value!r}, in docs/reports.md {described[key]}")
        elif not fits:
            wrong.append(f"in docs/reports.md write | `{key}` | TYPE: MEANING |")
    return wrong


def undocumented_keys(report: dict[str, Any]) -> set[str]:
    """Keys of a report of `process`, of its summary and of its details that the page lacks."""
    page = PAGE.read_text(encoding="utf-8")
    of_all = set(re.findall(r"^\| `(\w+)` \|", page.split("\n## ")[0], re.MULTILINE))
    of_process = set(re.findall(r"`(\w+)`", page.split("\n## Process\n")[1].split("\n## ")[0]))
    details = {
        *report["residual"],
        *report["confidence"],
        *(key for region in report["travel"].values() for key in region),
        *(key for closing in report.get("closings", []) for key in closing),
    }
    return ({*report} - of_all | {*report["summary"]} | details) - of_process
