import json
from pathlib import Path

import pytest

from usdface.errors import OutputError
from usdface.findings import finding
from usdface.outcome import Outcome, Steps
from usdface.papers import tables
from usdface.report import print_outcome, print_tables, progress, write_report

FINDINGS = (
    finding("MARKER_OCCLUDED", "nose [1]", "hidden in 3 of 9 frames"),
    finding("SHAPE_UNSEEN", "a"),
    *(finding("SHAPE_EMPTY", f"[bold]{i}[/bold]") for i in range(6)),
)
OUTCOME = Outcome(
    (Path("out [1]") / "näme.usda",), FINDINGS, {"frames": 9, "rate Hz": 29.97}, {"solve": 1.23456}
)


def test_text_says_every_figure_file_and_kind_of_finding_once(
    capsys: pytest.CaptureFixture[str],
) -> None:
    print_outcome(OUTCOME, "text")
    said = capsys.readouterr().out
    for wanted in ("frames", "29.97", "wrote out [1]/näme.usda", "(nose [1])"):
        assert wanted in said
    assert said.count("SHAPE_EMPTY") == 1
    assert "[bold]0[/bold], " in said and "and 2 more" in said


def test_json_is_the_outcome_and_nothing_else(capsys: pytest.CaptureFixture[str]) -> None:
    print_outcome(OUTCOME, "json")
    document = json.loads(capsys.readouterr().out)
    assert document["written"] == [str(Path("out [1]") / "näme.usda")]
    assert document["findings"] == [f.as_dict() for f in FINDINGS]
    assert document["summary"] == OUTCOME.summary
    assert document["seconds"] == {"solve": 1.235}
    assert document["peak_memory_mb"] > 1


def test_the_file_holds_what_json_prints(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_report(OUTCOME, tmp_path / "deep" / "report.json")
    print_outcome(OUTCOME, "json")
    written = json.loads((tmp_path / "deep" / "report.json").read_text(encoding="utf-8"))
    printed = json.loads(capsys.readouterr().out)
    written.pop("peak_memory_mb"), printed.pop("peak_memory_mb")
    assert written == printed
    with pytest.raises(OutputError, match="cannot write"):
        write_report(OUTCOME, tmp_path / "deep" / "report.json" / "no.json")


def test_progress_is_for_terminals_only(capsys: pytest.CaptureFixture[str]) -> None:
    for shown in (True, False):
        with progress(shown) as on_step:
            assert on_step is None
    assert capsys.readouterr() == ("", "")


def test_progress_on_a_terminal_shows_the_step(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    monkeypatch.setenv("TERM", "xterm")
    with progress(True) as on_step:
        assert on_step is not None
        on_step("solve")
    said = capsys.readouterr()
    assert said.out == "" and "solve" in said.err


def test_steps_are_announced_and_timed_also_when_they_fail() -> None:
    heard: list[str] = []
    steps = Steps(heard.append)
    with steps("read"):
        pass
    with pytest.raises(KeyError), steps("solve"):
        raise KeyError
    with steps("read"):
        pass
    assert heard == ["read", "solve", "read"]
    assert list(steps.seconds) == ["read", "solve"] and min(steps.seconds.values()) >= 0


def test_tables_of_papers_are_printed_written_and_dumped(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    computed = tables()
    monkeypatch.setenv("COLUMNS", "30")
    print_tables(computed, "text", tmp_path / "tables.json")
    text = capsys.readouterr().out
    for table in computed:
        assert table.title.split()[0] in text
        assert all(f"|{figure:.3f}" in text for figure in table.computed.ravel())
    assert text.count("(kept)") == len(computed)
    print_tables(computed, "json", None)
    dumped = json.loads(capsys.readouterr().out)
    assert dumped == json.loads((tmp_path / "tables.json").read_text())
    assert len(dumped) == len(computed)
