"""What a format does not hold goes in notes, and is said; without notes names and numbers tell."""

from dataclasses import replace

import pytest
from every_term import SYSTEMS, both_ways
from expression_systems import expression_system

from usdface.errors import InputError
from usdface.fuzzy.rule_parser import parse_rule
from usdface.fuzzy.variables import Term, Variable
from usdface.io.fuzzy_formats.files import read_fuzzy_file, write_fuzzy_file


@pytest.mark.parametrize("suffix", [".fis", ".fcl", ".fll"])
def test_what_others_compute_in_another_way_is_said(tmp_path, suffix):
    plain = {"normalisation": "per_output", "else_rule": False, "face_unit": "none"}
    term = Term("up", "ramp", (0, 1))
    variables = (
        Variable("a_y", "input", terms=(term,), range=(0, 1)),
        Variable("joy", "output", default=0.5),
    )
    rules = (parse_rule("IF a_y IS up THEN joy IS 1"),)
    assert both_ways(tmp_path, expression_system(variables, rules, **plain), suffix)[1] == []
    for setting in ("normalisation", "else_rule", "face_unit"):
        other = {k: v for k, v in plain.items() if k != setting}
        _, codes = both_ways(tmp_path, expression_system(variables, rules, **other), suffix)
        assert codes == ["MEANING_DIFFERS"]


@pytest.mark.parametrize(
    ("suffix", "rule", "settings", "says"),
    [
        (".fcl", "brow_y IS VERY up", {}, "hedges in words that its standard does not have"),
        (".fcl", "(brow_y IS up OR lip_x IS up) AND brow_y IS s", {}, "parentheses in words"),
        (".fcl", "brow_y IS up", {"and_": "einstein"}, "norms beyond the standard's in words"),
        (".fcl", "brow_y IS NOT up", {"and_": "lukasiewicz"}, ""),
        (".fis", "brow_y IS up", {"and_": "einstein"}, "the norm of AND only as comments"),
    ],
)
def test_what_a_format_says_in_other_words_is_told_from_comments(
    tmp_path, suffix, rule, settings, says
):
    plain = {"normalisation": "per_output", "else_rule": False, "face_unit": "none"}
    rules = (parse_rule(f"IF {rule} THEN joy IS 1"),)
    term = Term("up", "ramp", (0.0, 1.0))
    variables = (
        Variable("brow_y", "input", terms=(term, replace(term, name="s"))),
        Variable("lip_x", "input", terms=(term,)),
        Variable("joy", "output", default=0.5),
    )
    system = expression_system(variables, rules, **plain, **settings)
    findings = write_fuzzy_file(tmp_path / f"a{suffix}", system)
    found = [f.message for f in findings if f.code == "MEANING_DIFFERS"]
    assert [says in message for message in found] == ([True] if says else [])


@pytest.mark.parametrize("suffix", [".fis", ".fcl", ".fll"])
def test_without_notes_the_name_says_what_an_input_reads(tmp_path, suffix):
    path = tmp_path / f"system{suffix}"
    write_fuzzy_file(path, SYSTEMS["others"])
    lines = [line for line in path.read_text().splitlines() if "usdface:" not in line]
    path.write_text("\n".join(lines))
    system, findings = read_fuzzy_file(path)
    assert [(f.role, f.axis, f.measure) for f in system.features] == [
        ("brow", "y", "signed"),
        ("lip", "x", "signed"),
    ]
    assert [f.code for f in findings if f.code == "ROLE_ASSUMED"] == ["ROLE_ASSUMED"] * 2
    assert not system.fuzzy.else_rule and system.fuzzy.normalisation == "per_output"


@pytest.mark.parametrize(
    "note",
    [
        "{",
        "[1]",
        '{"nothing": 1}',
        '{"input": "nobody"}',
        '{"input": ["lip_x"]}',
        '{"input": "lip_x", "kind": "output"}',
        '{"input": "lip_x", "axis": "w"}',
        '{"rule": 99, "enabled": false}',
        '{"rule": 1, "enabled": 0}',
        '{"rule": 1, "weight": 7}',
        '{"system": {"gain": "much"}}',
        '{"system": {"gain": true}}',
        '{"system": {"variables": []}}',
        '{"system": 3}',
        "[" * 100_000,
    ],
)
@pytest.mark.parametrize(("suffix", "mark"), [(".fis", "%"), (".fcl", "//"), (".fll", "#")])
def test_a_wrong_note_is_refused_with_its_line(tmp_path, suffix, mark, note):
    path = tmp_path / f"system{suffix}"
    write_fuzzy_file(path, SYSTEMS["others"])
    path.write_text(f"{mark} usdface: {note}\n{path.read_text()}")
    with pytest.raises(InputError, match=rf"system{suffix}, line 1: ") as error:
        read_fuzzy_file(path)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("suffix", [".fis", ".fcl", ".fll"])
@pytest.mark.parametrize(("top", "unit"), [(0.3, "marker_spread"), (4.0, "none")])
def test_the_unit_of_a_file_that_names_none_is_taken_from_how_far_its_terms_reach(
    tmp_path, suffix, top, unit
):
    """A face unit is centimetres, so no feature is larger than one; widths and slopes may be."""
    terms = (Term("up", "ramp", (0.1, top)), Term("steep", "sigmoid", (0.2, 50.0)))
    brow = Variable("brow_y", "input", terms=terms, range=(-top, top))
    rule = parse_rule("IF brow_y IS up THEN joy IS 1")
    place = tmp_path / f"a{suffix}"
    write_fuzzy_file(place, expression_system((brow, Variable("joy", "output")), (rule,)))
    lines = [line for line in place.read_text().splitlines() if "usdface:" not in line]
    place.write_text("\n".join(lines))
    system, findings = read_fuzzy_file(place)
    assert system.face_unit == unit
    (reported,) = (f.message for f in findings if f.code == "UNITS_ASSUMED")
    assert f"reach to {top:g}" in reported and ("millimetres" in reported) == (unit == "none")
