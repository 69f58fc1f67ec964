import json
from pathlib import Path

import pytest
from documented_findings import undocumented_keys
from processed import report as written_report
from processed import shoot
from worlds import make_world

from usdface.cli.report import print_result, write_report
from usdface.errors import OutputError
from usdface.findings import finding
from usdface.result import Result

FINDINGS = (
    finding("MARKER_OCCLUDED", "nose [1]", "occluded in 3 of 9 frames"),
    finding("SHAPE_UNSEEN", "a"),
    *(finding("SHAPE_EMPTY", f"[bold]{i}[/bold]") for i in range(6)),
)
RESULT = Result(
    None,
    (Path("out [1]") / "näme.usda",),
    FINDINGS,
    {"frames": 9, "rate_hz": 29.97, "emotion_peaks": {"joy": 0.5}},
    seconds={"solve": 1.23456},
)


def test_text_says_every_figure_file_and_kind_of_finding_once(
    capsys: pytest.CaptureFixture[str],
) -> None:
    print_result(RESULT, "text")
    printed = capsys.readouterr().out
    for wanted in (
        "frames",
        "rate [Hz]",
        "29.97",
        "joy 0.5",
        "wrote out [1]/näme.usda",
        "(nose [1])",
    ):
        assert wanted in printed
    assert printed.count("SHAPE_EMPTY") == 1
    assert "[bold]0[/bold], " in printed and "and 2 more" in printed


def test_names_are_printed_as_they_are_and_keys_as_labels(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Blend shapes may be called eye_L or tear_mm; only keys of the report are ours."""
    summary = {
        "least_certain": {"eye_L": 0.5, "tear_mm": 0.25},
        "new_markers": {"dot_1": {"shapes_undetermined": 3}},
    }
    print_result(Result(None, (), (), summary), "text")
    assert [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()] == [
        "least certain eye_L 0.5, tear_mm 0.25",
        "new markers dot_1: shapes undetermined 3",
    ]


def test_what_is_said_of_one_is_not_said_of_all(capsys: pytest.CaptureFixture[str]) -> None:
    occluded = [
        finding("MARKER_OCCLUDED", m, f"occluded in {k} of 9") for k, m in enumerate("abcdef")
    ]
    print_result(Result(None, (), tuple(occluded)), "text")
    printed = capsys.readouterr().out
    assert (
        printed == "info MARKER_OCCLUDED: occluded in 0 of 9 (a); others: b, c, d, e and 1 more\n"
    )


def test_of_several_errors_the_largest_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    message = "{point_count} points are at most {error_mm:.3g} mm off"
    off = [finding("INFLUENCES_REDUCED", m, message, 9, k % 3) for k, m in enumerate("abcd")]
    print_result(Result(None, (), tuple(off)), "text")
    printed = capsys.readouterr().out
    assert (
        printed == "info INFLUENCES_REDUCED: 9 points are at most 2 mm off (c); others: b, a, d\n"
    )


@pytest.mark.parametrize(
    ("wheres", "message"),
    [
        (["t.c3d: chin", "t.c3d: nose"], "(t.c3d: chin); others: nose"),
        (["t.c3d: chin", "u.c3d: nose"], "(t.c3d: chin); others: u.c3d: nose"),
        (["t.c3d", "t.c3d: nose"], "(t.c3d); others: t.c3d: nose"),
    ],
)
def test_a_file_that_all_are_in_is_named_once(
    wheres: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    occluded = [
        finding("MARKER_OCCLUDED", w, f"occluded in {k} of 9") for k, w in enumerate(wheres)
    ]
    print_result(Result(None, (), tuple(occluded)), "text")
    assert capsys.readouterr().out == f"info MARKER_OCCLUDED: occluded in 0 of 9 {message}\n"


def test_each_thing_that_a_code_warns_of_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    """One code may say several things; one thing may be said of many."""
    warned = [
        finding("MEANING_DIFFERS", "a.fll: joy", "the answers of joy are kept in 0 to 1"),
        finding("MEANING_DIFFERS", "a.fll: joy", "joy has no default"),
        finding("MEANING_DIFFERS", "a.fll: fear", "the answers of fear are kept in 0 to 2"),
        *(finding("RULE_FIRES_AT_NEUTRAL", f"line {k}", f'the rule "{k}" fires') for k in "ab"),
    ]
    print_result(Result(None, (), tuple(warned)), "text")
    assert capsys.readouterr().out.splitlines() == [
        "warning MEANING_DIFFERS: the answers of joy are kept in 0 to 1 (a.fll: joy); others: fear",
        "warning MEANING_DIFFERS: joy has no default (a.fll: joy)",
        'warning RULE_FIRES_AT_NEUTRAL: the rule "a" fires (line a); others: line b',
    ]
    many = [finding("MEANING_DIFFERS", "x", word * 3) for word in "abcdefg"]
    print_result(Result(None, (), tuple(many)), "text")
    first, *others = capsys.readouterr().out.splitlines()
    assert first.endswith("aaa (x); others: x, x, x") and len(others) == 3


def test_json_is_the_result_and_nothing_else(capsys: pytest.CaptureFixture[str]) -> None:
    print_result(RESULT, "json")
    document = json.loads(capsys.readouterr().out)
    assert document["written"] == [str(Path("out [1]") / "näme.usda")]
    assert document["findings"] == [f.as_dict() for f in FINDINGS]
    assert document["summary"] == RESULT.summary
    assert document["seconds"] == {"solve": 1.235}
    assert document["peak_memory_mb"] > 1


def test_the_file_holds_what_json_prints(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_report(RESULT, tmp_path / "deep" / "report.json")
    print_result(RESULT, "json")
    written = json.loads((tmp_path / "deep" / "report.json").read_text(encoding="utf-8"))
    printed = json.loads(capsys.readouterr().out)
    written.pop("peak_memory_mb"), printed.pop("peak_memory_mb")
    assert written == printed
    with pytest.raises(OutputError, match="cannot write"):
        write_report(RESULT, tmp_path / "deep" / "report.json" / "no.json")


def test_a_second_message_about_one_place_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    """It is not one of the "others", of which only the places are named."""
    found = [
        finding("MARKER_OCCLUDED", where, message)
        for where, message in (("a", "late"), ("a", "early"), ("b", "never"), ("a", "early"))
    ]
    print_result(Result(None, (), tuple(found)), "text")
    assert capsys.readouterr().out.splitlines() == [
        "info MARKER_OCCLUDED: late (a); others: b",
        "info MARKER_OCCLUDED: early (a)",
    ]


def test_what_is_left_out_is_not_hidden_by_another_loss(
    capsys: pytest.CaptureFixture[str],
) -> None:
    ignored = (
        ("head.usda", "materials that no mesh shows: {channels}", "Old"),
        ("/A", "primvars that usdface does not keep: {channels}", "ao"),
        ("/B", "primvars that usdface does not keep: {channels}", "dirt"),
        ("/A", "primvars that usdface does not keep: {channels}", "rest"),
    )
    found = [finding("CHANNEL_IGNORED", where, message, [name]) for where, message, name in ignored]
    print_result(Result(None, (), tuple(found)), "text")
    assert capsys.readouterr().out.splitlines() == [
        "info CHANNEL_IGNORED: materials that no mesh shows: Old (head.usda)",
        "info CHANNEL_IGNORED: primvars that usdface does not keep: ao (/A); others: /B",
        "info CHANNEL_IGNORED: primvars that usdface does not keep: rest (/A)",
    ]


def test_a_figure_without_entries_is_none(capsys: pytest.CaptureFixture[str]) -> None:
    print_result(Result(None, (), (), {"gains": {}}), "text")
    assert capsys.readouterr().out.split() == ["gains", "none"]


def test_records_have_a_line_each_and_a_range_its_word(capsys: pytest.CaptureFixture[str]) -> None:
    """As the places of 24 new markers: in one line they were a wall."""
    places = {name: {"place": "left brow", "shapes_undetermined": 3} for name in ("a", "b")}
    summary = {"new_markers": places, "neutral_frames": [0, 29], "peak_frames": [3, 9]}
    print_result(Result(None, (), (), summary), "text")
    assert [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()] == [
        "new markers a: left brow, shapes undetermined 3",
        "b: left brow, shapes undetermined 3",
        "neutral frames 0 to 29",
        "peak frames 3, 9",
    ]


def test_levels_of_verdicts_are_in_words(capsys: pytest.CaptureFixture[str]) -> None:
    summary = {"verdicts": {"good": 2, "look_at": 1, "not_usable": 0}}
    print_result(Result(None, (), (), summary), "text")
    assert capsys.readouterr().out.split(maxsplit=1)[1].strip() == "good 2, look at 1, not usable 0"


def test_a_figure_is_in_one_line_of_a_log(capsys: pytest.CaptureFixture[str]) -> None:
    places = ["left eye, 9 mm from marker lid_upper_left (vertex 1869)"] * 5
    print_result(Result(None, (), (), {"next_markers": places}), "text")
    assert len(capsys.readouterr().out.splitlines()) == 1


def test_the_page_has_the_keys_of_process(tmp_path: Path) -> None:
    shot = shoot(make_world().write(tmp_path))
    made = written_report(tmp_path, "process", shot, "--cache", tmp_path / "cache")
    assert undocumented_keys(made) == set()
    assert undocumented_keys(made | {"new": 1, "summary": {"more": 2}}) == {"new", "more"}
