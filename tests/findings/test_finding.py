import ast
import re
from functools import lru_cache
from pathlib import Path
from string import Formatter
from typing import get_args

import numpy as np
import pytest
from documented_findings import documented_keys, row_of

import usdface
from usdface.errors import InputError
from usdface.findings import Finding, finding, severest, timed
from usdface.findings.codes import CODES, Action, Severity
from usdface.findings.values import Prose

PACKAGE = Path(usdface.__file__).parent
SOURCES = [path for path in PACKAGE.rglob("*.py") if path.name != "finding.py"]
# Keys of words that only the message has (`Prose`)
PROSE = {"hint", "message", "more", "most", "place", "when", "why"}
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
        "action": CODES[code][1],
        "where": "face.glb",
        "values": {},
    }


def test_an_own_message_replaces_the_default() -> None:
    assert finding("SHAPE_SKIPPED", "/Face", "nothing moves") == Finding(
        "SHAPE_SKIPPED", "/Face", "nothing moves", "warning"
    )


def test_the_values_of_a_message_are_those_of_the_report() -> None:
    names = [f"m{number}" for number in range(10)]
    made = finding("MARKER_UNBOUND", "take", "{unbound_count:.1f}: {markers}", np.int64(3), names)
    assert made.message == "3.0: m0, m1, m2, m3, m4, m5, m6, m7 and 2 more"
    assert made.values == {"unbound_count": 3, "markers": names}


def test_names_from_a_file_are_no_template() -> None:
    assert finding("NAME_CHANGED", "a", "was {original!r}", "{code}").message == "was '{code}'"
    assert finding("NAME_CHANGED", "a", "now {code}").message == "now {code}"


def test_prose_and_errors_are_no_values() -> None:
    error = InputError("too long", "TOO_LARGE")
    made = finding("FILE_UNREADABLE", "a", "{error}, {why}", error, Prose("as we say"))
    assert made.message == "too long, as we say" and made.values == {"error": "TOO_LARGE"}


def test_values_are_as_many_as_the_keys_of_the_message() -> None:
    with pytest.raises(ValueError):
        finding("MARKER_OCCLUDED", "chin", "occluded in {count} of {frame_count} frames", 3)


def test_frames_have_their_times() -> None:
    found = finding("CONTACT_KEPT", "lips", first_frame=1, last_frame=3)
    blinks = finding("BLINK_GUESSED", "lids", frames=[2, 9])
    made = timed([found, blinks], [0.0, 0.25, 0.5, 0.75])
    assert made[0].values == {**found.values, "start_s": 0.25, "end_s": 0.75}
    assert made[1].values == {"frames": [2, 9], "times_s": [0.5, None]}


def test_an_unknown_code_is_a_mistake_of_the_program() -> None:
    with pytest.raises(KeyError, match="did you mean MARKER_OCCLUDED"):
        finding("MARKER_OCLUDED", "here")


@lru_cache(maxsize=1)
def _calls() -> tuple[tuple[str, ast.Call], ...]:
    texts = {path: path.read_text(encoding="utf-8") for path in SOURCES}
    return tuple(
        (path.relative_to(PACKAGE).as_posix(), node)
        for path, text in texts.items()
        if "finding(" in text
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "finding"
    )


def test_no_call_puts_a_value_into_its_words() -> None:
    """A value in an f-string would be in the message alone; and a template is not from a file."""
    for place, call in _calls():
        shown = [part for part in call.args[2:3] for part in ast.walk(part)]
        holes = [part for part in shown if isinstance(part, ast.FormattedValue)]
        assert all(isinstance(hole.value, ast.Name) for hole in holes), f"{place}:{call.lineno}"


def test_every_key_of_a_call_is_documented() -> None:
    documented = documented_keys()
    for place, call in _calls():
        given = {keyword.arg for keyword in call.keywords if keyword.arg}
        template = call.args[2] if len(call.args) > 3 else None
        if isinstance(template, ast.Constant):
            given |= {key for _, key, _, _ in Formatter().parse(template.value) if key}
        if isinstance(call.args[0], ast.Constant):
            code = call.args[0].value
            row = row_of(code, documented[code] | given - PROSE)
            known = given <= documented[code] | PROSE
            assert known, f"{place}:{call.lineno}: in docs/reports.md write {row}"


def test_the_keys_are_in_the_order_of_the_codes() -> None:
    codes = [code for code, keys in documented_keys().items() if keys]
    assert codes == sorted(codes)


def test_every_action_is_documented() -> None:
    page = (PACKAGE.parent / "docs" / "reports.md").read_text(encoding="utf-8")
    assert all(f"| `{action}` | " in page for action in get_args(Action))
    assert {action for _, action, _ in CODES.values()} == set(get_args(Action))


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
    rows = {f"| `{code}` | {severity} | {says} " for code, (severity, _, says) in CODES.items()}
    lines = [li for li in page.read_text(encoding="utf-8").splitlines() if li.startswith("| `")]
    shown, to_do = zip(*(line.removesuffix(" |").rsplit("| ", 1) for line in lines), strict=True)
    lacking = "".join(f"\n{row}| REMEDY |" for row in sorted(rows - set(shown)))
    assert not lacking, f"in docs/findings.md write{lacking}"
    of_no_code = "\n".join(sorted(set(shown) - rows))
    assert not of_no_code, f"no row of usdface/findings/codes.py, remove:\n{of_no_code}"
    assert list(shown) == sorted(shown), "docs/findings.md is in the order of the codes"
    assert all(to_do)


@pytest.mark.parametrize(
    ("template", "values", "said"),
    [
        (
            "limited in {frame_count} frames ({first_frame} to {last_frame})",
            (1, 7, 7),
            "1 frame (7)",
        ),
        (
            "limited in {frame_count} frames ({first_frame} to {last_frame})",
            (2, 7, 9),
            "2 frames (7 to 9)",
        ),
        ("rests in frames {first_frame} to {last_frame}: neutral", (7, 7), "in frame 7: neutral"),
    ],
)
def test_one_frame_is_told_in_the_singular(
    template: str, values: tuple[int, ...], said: str
) -> None:
    found = finding("CONTACT_KEPT", "lips", template, *values)
    assert said in found.message
    assert list(found.values.values()) == list(values)
