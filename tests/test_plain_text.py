"""What came from outside is printed escaped and shortened."""

import json
import os
from pathlib import Path

import pytest
from checkout import run_usdface

from usdface.cli import main
from usdface.errors import InputError
from usdface.findings import finding
from usdface.plain_text import error_line, listed, plain


def test_control_characters_are_escaped() -> None:
    assert plain("grün 顔", 80) == "grün 顔"
    assert plain("a\x1b[31m\r\n\u202eb\udcff", 80) == r"a\x1b[31m\r\n\u202eb\udcff"
    assert plain("a\nb", 80, keep="\n") == "a\nb"


def test_long_texts_are_cut_in_the_middle() -> None:
    text = plain("start" + 10_000 * "x" + "end", 100)
    assert len(text) < 120 and text.startswith("start") and text.endswith("end")


def test_a_long_list_says_how_many_more_there_are() -> None:
    assert listed(["a", "b", "c"], 3) == "a, b, c"
    assert listed(["a", "b", "c", "d"], 2) == "a, b and 2 more"
    assert listed([], 2) == ""


def test_errors_and_findings_are_one_line() -> None:
    name = "a\nb\x07" + 5000 * "c"
    error, found = InputError(f"no marker {name}"), finding("MARKER_UNBOUND", name, f"of {name}")
    for text in (str(error), found.where, found.message):
        assert text.isprintable() and len(text) < 900


def test_the_screen_shows_no_escape_sequence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = "".join(f"{n / 60},1,2,{n},4,5,6\n" for n in range(5))
    (tmp_path / "t.csv").write_text("time,a\x1b[31m_x,a\x1b[31m_y,a\x1b[31m_z,b_x,b_y,b_z\n" + rows)
    main(["take", str(tmp_path / "t.csv"), "-o", str(tmp_path / "t.usda")])
    printed = capsys.readouterr()
    assert "\x1b" not in printed.out + printed.err


@pytest.mark.parametrize(
    "encoding",
    ["ascii", *(pytest.param(name, marks=pytest.mark.slow) for name in ("latin-1", "utf-8"))],
)
def test_any_terminal_and_any_file_name(tmp_path: Path, encoding: str) -> None:
    rows = "".join(f"{n / 60},1,2,{n},4,5,6\n" for n in range(5))
    source = os.fsencode(tmp_path) + b"/ta\xffke.csv"
    with open(source, "w", encoding="utf-8") as file:  # noqa: PTH123
        file.write("time,顔_x,顔_y,顔_z,b_x,b_y,b_z\n" + rows)
    target, report = os.fsencode(tmp_path) + "/ergebnis_é.usda".encode(), tmp_path / "r.json"
    words = ("take", source, "-o", target, "--report", report)
    done = run_usdface(*words, PYTHONIOENCODING=encoding)
    assert done.returncode == 0, done.stderr
    assert b"Traceback" not in done.stderr and os.path.exists(target)  # noqa: PTH110
    assert json.loads(report.read_text())["written"][-1] == str(report)


def test_an_error_of_other_code_is_one_line() -> None:
    assert error_line(ValueError("no\n  such thing")) == "ValueError: no such thing"
