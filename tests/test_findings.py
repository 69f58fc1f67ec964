import re
from pathlib import Path
from typing import get_args

import pytest

from usdface import findings
from usdface.findings import CODES, Finding, Severity, finding, severest

PACKAGE = Path(findings.__file__).parent
SOURCES = [path for path in PACKAGE.rglob("*.py") if path != Path(findings.__file__)]
TEXT = "\n".join(path.read_text(encoding="utf-8") for path in SOURCES)


@pytest.mark.parametrize("code", CODES)
def test_the_table_gives_severity_and_message(code: str) -> None:
    made = finding(code, "face.glb")
    assert re.fullmatch(r"[A-Z][A-Z_]*[A-Z]", code)
    assert made.severity in get_args(Severity)
    assert made.message.strip() == made.message != ""
    assert not made.message.endswith(".") and "\n" not in made.message
    assert made.as_dict() == {
        "code": code,
        "severity": made.severity,
        "where": "face.glb",
        "message": made.message,
    }


def test_an_own_message_replaces_the_default() -> None:
    assert finding("SHAPE_SKIPPED", "/Face", "nothing moves") == Finding(
        "SHAPE_SKIPPED", "/Face", "nothing moves", "warning"
    )


def test_an_unknown_code_is_a_mistake_of_the_program() -> None:
    with pytest.raises(KeyError):
        finding("NONSENSE", "here")


def test_severest() -> None:
    info, warning = finding("MARKER_OCCLUDED", ""), finding("SHAPE_SKIPPED", "")
    error = Finding("X", "", "x", "error")
    assert severest([]) == "info"
    assert severest([warning, info]) == "warning"
    assert severest([info, error, warning]) == "error"


def test_every_code_is_used() -> None:
    assert [code for code in CODES if f'"{code}"' not in TEXT] == []


def test_every_used_code_is_in_the_table() -> None:
    used = set(re.findall(r'\bfinding\(\s*"([A-Z_]+)"', TEXT))
    assert used and used <= set(CODES)


def test_the_documented_table_is_the_table() -> None:
    page = PACKAGE.parent / "docs" / "findings.md"
    rows = [f"| `{code}` | {severity} | {says} " for code, (severity, says) in CODES.items()]
    lines = [li for li in page.read_text(encoding="utf-8").splitlines() if li.startswith("| `")]
    shown, to_do = zip(*(line.removesuffix(" |").rsplit("| ", 1) for line in lines), strict=True)
    assert list(shown) == sorted(rows)
    assert all(to_do)
