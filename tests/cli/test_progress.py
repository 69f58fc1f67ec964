import argparse
import json

import pytest

from usdface.cli.progress import progress
from usdface.progress import COMPILE, Step


def asked(form: str = "auto", report: str = "text") -> argparse.Namespace:
    return argparse.Namespace(progress=form, format=report)


@pytest.mark.parametrize("report", ["text", "json"])
def test_elsewhere_than_on_terminals_only_a_long_wait_is_named(
    report: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with progress(asked(report=report)) as on_progress:
        on_progress(Step("solve"))
        assert capsys.readouterr() == ("", "")
        on_progress(Step(COMPILE))
    assert capsys.readouterr() == ("", "usdface: compile the solver (once) ...\n")


def test_progress_on_a_terminal_shows_the_step(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    monkeypatch.setenv("TERM", "xterm")
    with progress(asked()) as on_progress:
        on_progress(Step("read"))
        on_progress(Step("solve", 0.5))
    printed = capsys.readouterr()
    assert printed.out == "" and "solve" in printed.err


def test_plain_progress_is_a_line_for_each_tenth_of_a_step(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with progress(asked("plain")) as on_progress:
        on_progress(Step("read"))
        for done in range(101):
            on_progress(Step("solve", done / 100))
    lines = capsys.readouterr().err.splitlines()
    assert lines[:2] == ["usdface: read", "usdface: solve 0%"]
    assert len(lines) == 12 and lines[-1] == "usdface: solve 100%"


def test_json_progress_is_an_object_a_line(capsys: pytest.CaptureFixture[str]) -> None:
    with progress(asked("json", "json")) as on_progress:
        on_progress(Step("read"))
        on_progress(Step('so"lve\n', 0.25))
    read, solve = map(json.loads, capsys.readouterr().err.splitlines())
    assert (read["step"], read["fraction"]) == ("read", None)
    assert (solve["step"], solve["fraction"]) == ('so"lve\n', 0.25)
    assert 0 <= read["seconds"] <= solve["seconds"]


def test_progress_that_nobody_takes_any_more_ends_no_work(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    class Full:
        def write(self, text: str) -> None:
            raise OSError(28, "No space left on device")

    monkeypatch.setattr("sys.stderr", Full())
    for form in ("plain", "json", "openjd"):
        with progress(asked(form)) as on_progress:
            on_progress(Step("read"))


def test_no_progress_is_none(capsys: pytest.CaptureFixture[str]) -> None:
    with progress(asked("none")) as on_progress:
        on_progress(Step(COMPILE))
    assert capsys.readouterr() == ("", "")
