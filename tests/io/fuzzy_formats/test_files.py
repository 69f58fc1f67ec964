"""What our systems hold comes back from every format, and means the same."""

import json
from dataclasses import replace
from math import inf

import numpy as np
import pytest
from pxr import Usd

from usdface.cli import main
from usdface.errors import InputError, OutputError
from usdface.fuzzy.inference import evaluate
from usdface.fuzzy.paper import paper_system, published_table
from usdface.fuzzy.rules import parse_rule
from usdface.fuzzy.system import FuzzySystem, Term, Variable
from usdface.io.fuzzy_formats.files import read_fuzzy_file, write_fuzzy_file
from usdface.io.usd.fuzzy import write_fuzzy

TERMS = (
    Term("tri", "triangular", (-1, -0.5, 0.25)),
    Term("trap", "trapezoidal", (-0.5, 0, 0.25, 1)),
    Term("up", "ramp", (0.1, 1)),
    Term("down", "ramp", (0, -1)),
    Term("gauss", "gaussian", (0.3, 0.7)),
    Term("pair", "gaussian_pair", (-0.5, 0.3, 0.6, 0.8)),
    Term("sig", "sigmoid", (0.2, -4)),
    Term("bell", "bell", (0.1, 0.8, 1.5)),
    Term("s", "s_shape", (-1, 0.5)),
    Term("z", "z_shape", (-1, 0.5)),
    Term("pi", "pi_shape", (-1, 0, 0.5, 1)),
)
FORMATS = (".fis", ".fcl", ".fll", ".usda", ".usdc")
A = Variable("brow_y", "input", "left brow", "z", "absolute", TERMS)
B = Variable("lip_x", "input", "lip", "x", "signed", TERMS[::-1], range=(-2, 2))


def sugeno(**settings):
    joy = Variable("joy", "output")
    plane = (Term("plane", "linear", (0.5, -1, 2)), Term("flat", "constant", (-0.25,)))
    out = Variable("out", "output", terms=plane, range=(-3, 5), default=0.5)
    rules = [f"IF brow_y IS {t.name} AND lip_x IS NOT {t.name} THEN joy IS 0.3" for t in TERMS]
    rules += ["IF brow_y IS up OR lip_x IS sig THEN joy IS 1 AND out IS plane"]
    rules += ["IF lip_x IS bell THEN out IS flat", "IF lip_x IS pi THEN out IS 1.125"]
    made = [parse_rule(rule, (20 - i) / 20, i != 3) for i, rule in enumerate(rules)]
    return FuzzySystem((A, B, joy, out), tuple(made), **settings)


def mamdani(**settings):
    terms = (Term("low", "triangular", (0, 1, 4)), Term("high", "pi_shape", (1, 3, 5, 6)))
    out = Variable("out", "output", terms=terms, range=(0, 6), default=2)
    rules = (
        parse_rule("IF brow_y IS tri AND lip_x IS gauss THEN out IS low"),
        parse_rule("IF lip_x IS NOT s THEN out IS high", 0.5),
    )
    return FuzzySystem((A, B, out), rules, inference="mamdani", **settings)


def both_ways(tmp_path, system, suffix):
    path = tmp_path / f"system{suffix}"
    written = write_fuzzy_file(path, system)
    found, read = read_fuzzy_file(path)
    assert read == []
    return found, [f.code for f in written]


SYSTEMS = {
    "default": sugeno(),
    "others": sugeno(
        normalisation="per_output", and_="prod", or_="probor", neutral_rule=False, mode="add"
    ),
    "far": sugeno(normalisation="weighted_sum", and_="hamacher", or_="einstein", gain=0.7),
    "mamdani": mamdani(),
    "mamdani far": mamdani(
        implication="einstein",
        aggregation="sum",
        defuzzifier="mean_of_max",
        samples=57,
        sampling="middles",
        space="take",
        face_unit="none",
    ),
}


@pytest.mark.parametrize("suffix", FORMATS)
@pytest.mark.parametrize("name", SYSTEMS)
def test_every_format_gives_back_what_it_was_given(tmp_path, name, suffix):
    found, _ = both_ways(tmp_path, SYSTEMS[name], suffix)
    assert found == SYSTEMS[name]


@pytest.mark.parametrize("suffix", FORMATS)
def test_the_papers_system_means_the_same(tmp_path, suffix):
    system = paper_system()
    found, _ = both_ways(tmp_path, system, suffix)
    inputs = np.random.default_rng(0).uniform(-1, 3, (200, len(system.inputs)))
    np.testing.assert_array_equal(evaluate(found, inputs).outputs, evaluate(system, inputs).outputs)
    assert [v.role for v in found.inputs] == [v.role for v in system.inputs]
    again, _ = both_ways(tmp_path, found, suffix)
    assert again == found


@pytest.mark.parametrize("suffix", (".fcl", ".fll", ".usda"))
def test_hedges_and_parentheses(tmp_path, suffix):
    text = (
        "IF (brow_y IS VERY up OR lip_x IS NOT SOMEWHAT up) AND brow_y IS EXTREMELY s THEN joy IS 1"
    )
    system = FuzzySystem((A, B, Variable("joy", "output")), (parse_rule(text),))
    assert both_ways(tmp_path, system, suffix)[0] == system


@pytest.mark.parametrize(
    ("rule", "suffixes", "says"),
    [
        ("IF brow_y IS very up THEN joy IS 1", [".fis"], "no other hedge"),
        (
            "IF brow_y IS up OR lip_x IS up AND brow_y IS s THEN joy IS 1",
            [".fis"],
            "split the rule",
        ),
        ("IF brow_y IS up AND brow_y IS s THEN joy IS 1", [".fis"], "asks brow_y twice"),
        ("IF NOT (brow_y IS up OR lip_x IS up) THEN joy IS 1", [".fll", ".fis"], "NOT"),
    ],
)
def test_a_rule_that_a_format_cannot_hold_is_refused_by_name(tmp_path, rule, suffixes, says):
    system = FuzzySystem((A, B, Variable("joy", "output")), (parse_rule(rule),))
    for suffix in suffixes:
        with pytest.raises(OutputError, match=says) as error:
            write_fuzzy_file(tmp_path / f"a{suffix}", system)
        assert rule in str(error.value)
        assert not (tmp_path / f"a{suffix}").exists()


def test_not_before_parentheses_travels_in_fcl(tmp_path):
    rule = parse_rule("IF NOT (brow_y IS up OR lip_x IS up) THEN joy IS 1")
    system = FuzzySystem((A, B, Variable("joy", "output")), (rule,))
    assert both_ways(tmp_path, system, ".fcl")[0] == system


@pytest.mark.parametrize("suffix", [".fis", ".fcl", ".fll"])
def test_what_others_compute_in_another_way_is_said(tmp_path, suffix):
    plain = {"normalisation": "per_output", "neutral_rule": False, "face_unit": "none"}
    term = Term("up", "ramp", (0, 1))
    variables = (
        Variable("a_y", "input", "a", terms=(term,), range=(0, 1)),
        Variable("joy", "output", default=0.5),
    )
    rules = (parse_rule("IF a_y IS up THEN joy IS 1"),)
    assert both_ways(tmp_path, FuzzySystem(variables, rules, **plain), suffix)[1] == []
    for setting in ("normalisation", "neutral_rule", "face_unit"):
        other = {k: v for k, v in plain.items() if k != setting}
        _, codes = both_ways(tmp_path, FuzzySystem(variables, rules, **other), suffix)
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
    plain = {"normalisation": "per_output", "neutral_rule": False, "face_unit": "none"}
    rules = (parse_rule(f"IF {rule} THEN joy IS 1"),)
    term = Term("up", "ramp", (0.0, 1.0))
    variables = (
        Variable("brow_y", "input", "brow", terms=(term, replace(term, name="s"))),
        Variable("lip_x", "input", "lip", axis="x", terms=(term,)),
        Variable("joy", "output", default=0.5),
    )
    system = FuzzySystem(variables, rules, **plain, **settings)
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
    assert [(v.role, v.axis, v.measure) for v in system.inputs] == [
        ("brow", "y", "signed"),
        ("lip", "x", "signed"),
    ]
    assert [f.code for f in findings if f.code == "ROLE_ASSUMED"] == ["ROLE_ASSUMED"] * 2
    assert not system.neutral_rule and system.normalisation == "per_output"


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


@pytest.mark.parametrize("suffix", FORMATS)
@pytest.mark.parametrize("data", [b"", b"\n \n", b"\0" * 99, b"\xff\xfe\x80 what", b"%PDF-1.4\n"])
def test_what_is_no_fuzzy_system_is_refused_in_one_line(tmp_path, suffix, data):
    path = tmp_path / f"a{suffix}"
    path.write_bytes(data)
    with pytest.raises(InputError) as error:
        read_fuzzy_file(path)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("suffix", [".fis", ".fcl", ".fll"])
def test_any_cut_of_a_file_is_a_system_or_an_error(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    write_fuzzy_file(path, SYSTEMS["mamdani"])
    text = path.read_text()
    refused = 0
    for end in range(0, len(text) - 1, 61):
        path.write_text(text[:end])
        try:
            read_fuzzy_file(path)
        except InputError as error:
            assert "\n" not in str(error)
            refused += 1
    assert refused > 5


@pytest.mark.parametrize("suffix", [".fis", ".fcl", ".fll"])
def test_any_changed_word_is_a_system_or_an_error(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    write_fuzzy_file(path, SYSTEMS["mamdani"])
    words = path.read_text().split(" ")
    rng = np.random.default_rng(0)
    refused = 0
    for _ in range(60):
        changed = list(words)
        odd = ["nan", "-1e999", "(", "'", "[", ";", "1", "", "1e400", "0x1", "=", ":", "None"]
        changed[rng.integers(len(words))] = str(rng.choice(odd))
        path.write_text(" ".join(changed))
        try:
            read_fuzzy_file(path)
        except InputError as error:
            assert "\n" not in str(error)
            refused += 1
    assert refused > 20


@pytest.mark.parametrize("suffix", [".fis", ".fcl", ".fll"])
@pytest.mark.parametrize("name", ["mamdani", "default"])
def test_any_splice_into_a_file_is_a_system_or_an_error(tmp_path, suffix, name):
    path = tmp_path / f"a{suffix}"
    write_fuzzy_file(path, SYSTEMS[name])
    text = path.read_text()
    odd = ["", ";", ":", "(", ")", "'", "[", "\n", "nan", "inf", "-1e999", "RULE", "/*", "#", "= 0"]
    rng = np.random.default_rng(1)
    outcomes = set()
    for _ in range(300):
        at = int(rng.integers(len(text)))
        spliced = text[:at] + odd[rng.integers(len(odd))] + text[at + int(rng.integers(7)) :]
        path.write_text(spliced)
        try:
            system, _ = read_fuzzy_file(path)
        except InputError as error:
            assert "\n" not in str(error)
            outcomes.add("refused")
        else:
            answer = evaluate(system, np.zeros((2, len(system.inputs))))
            assert np.isfinite(answer.outputs).all()
            outcomes.add("read")
    assert outcomes == {"refused", "read"}


def test_a_term_that_a_format_has_no_name_for_is_refused(tmp_path):
    term = Term("far(left)", "ramp", (0, 1))
    system = FuzzySystem((Variable("a", "input", "a", terms=(term,)),), ())
    for suffix in (".fis", ".fcl", ".fll"):
        with pytest.raises(OutputError, match=r"far\(left\).*rename it"):
            write_fuzzy_file(tmp_path / f"a{suffix}", system)


def test_infinite_feet(tmp_path):
    terms = (
        Term("left", "triangular", (-inf, 0, 1)),
        Term("right", "trapezoidal", (0, 1, 2, inf)),
        Term("all", "triangular", (-inf, 0, inf)),
    )
    variable = Variable("a_x", "input", "a", "x", terms=terms)
    rules = tuple(parse_rule(f"IF a_x IS {t.name} THEN joy IS 1") for t in terms)
    system = FuzzySystem((variable, Variable("joy", "output")), rules)
    x = np.linspace(-2, 3, 101)[:, None]
    for suffix in (".fis", ".fcl", ".fll"):
        found, _ = both_ways(tmp_path, system, suffix)
        np.testing.assert_array_equal(evaluate(found, x).firing, evaluate(system, x).firing)


def test_other_suffixes_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"\.fis"):
        read_fuzzy_file(tmp_path / "a.json")
    with pytest.raises(OutputError, match=r"\.fis"):
        write_fuzzy_file(tmp_path / "a.json", SYSTEMS["default"])


def test_the_command_goes_through_all_formats_and_says_what_is_doubtful(tmp_path, capsys):
    system = sugeno()
    place = tmp_path / "a.usda"
    write_fuzzy_file(place, system)
    for suffix in (".fll", ".fis", ".fcl", ".usdc"):
        source, place = place, tmp_path / f"a{suffix}"
        assert main(["fuzzy", "convert", str(source), "-o", str(place), "--format", "json"]) == 0
        said = json.loads(capsys.readouterr().out)
        codes = {f["code"] for f in said["findings"]}
        assert {"RULE_FIRES_AT_NEUTRAL", "RULE_UNREACHABLE"} <= codes
        assert ("MEANING_DIFFERS" in codes) == (suffix != ".usdc")
        assert said["summary"]["rules"] == len(system.rules)
    assert read_fuzzy_file(place)[0] == system


def test_a_failed_conversion_writes_nothing(tmp_path, capsys):
    source, place = tmp_path / "a.fll", tmp_path / "a.fis"
    source.write_text("Engine: a\nInputVariable: x\n  term: t Spike 1 2\n")
    assert main(["fuzzy", "convert", str(source), "-o", str(place)]) == 1
    assert capsys.readouterr().err.startswith("usdface: a.fll, line 3: the term 'Spike'")
    assert not place.exists()


def test_usd_holds_exactly_one_system(tmp_path):
    stage = Usd.Stage.CreateNew(str(tmp_path / "two.usda"))
    with pytest.raises(InputError, match="expected one UsdFaceFuzzySystem, found none"):
        read_fuzzy_file(tmp_path / "two.usda")
    for path in ("/A", "/B"):
        write_fuzzy(stage, path, SYSTEMS["default"])
    stage.Save()
    with pytest.raises(InputError, match="found /A, /B"):
        read_fuzzy_file(tmp_path / "two.usda")


@pytest.mark.parametrize("suffix", [".fis", ".fcl", ".fll", ".usda"])
def test_the_papers_table_comes_out_of_a_file_of_its_system(tmp_path, capsys, suffix):
    place = tmp_path / f"paper{suffix}"
    assert main(["fuzzy", "paper", "-o", str(place), "--format", "json"]) == 0
    said = json.loads(capsys.readouterr().out)
    fires = [f["message"] for f in said["findings"] if f["code"] == "RULE_FIRES_AT_NEUTRAL"]
    assert len(fires) == 1 and "THEN anger IS 1" in fires[0]
    system, findings = read_fuzzy_file(place)
    assert findings == []
    table = published_table(system)
    assert table.rms < 0.009 and table.largest < 0.041
    assert evaluate(system, np.zeros((1, 13))).outputs[0].tolist() == [0, 0, 1, 0, 0, 0]


@pytest.mark.parametrize("suffix", [".fis", ".fcl", ".fll"])
@pytest.mark.parametrize(("top", "unit"), [(0.3, "marker_spread"), (4.0, "none")])
def test_the_unit_of_a_file_that_names_none_is_taken_from_how_far_its_terms_reach(
    tmp_path, suffix, top, unit
):
    """A face unit is centimetres, so no feature is larger than one; widths and slopes may be."""
    terms = (Term("up", "ramp", (0.1, top)), Term("steep", "sigmoid", (0.2, 50.0)))
    brow = Variable("brow_y", "input", "brow", terms=terms, range=(-top, top))
    rule = parse_rule("IF brow_y IS up THEN joy IS 1")
    place = tmp_path / f"a{suffix}"
    write_fuzzy_file(place, FuzzySystem((brow, Variable("joy", "output")), (rule,)))
    lines = [line for line in place.read_text().splitlines() if "usdface:" not in line]
    place.write_text("\n".join(lines))
    system, findings = read_fuzzy_file(place)
    assert system.face_unit == unit
    (said,) = (f.message for f in findings if f.code == "UNITS_ASSUMED")
    assert f"reach to {top:g}" in said and ("millimetres" in said) == (unit == "none")


def test_a_list_of_points_is_refused_where_a_format_has_none(tmp_path):
    terms = (Term("bent", "points", (0, 0, 1, 0.3, 2, 1)),)
    brow = Variable("brow_y", "input", "brow", terms=terms)
    rule = parse_rule("IF brow_y IS bent THEN joy IS 1")
    system = FuzzySystem((brow, Variable("joy", "output")), (rule,))
    with pytest.raises(OutputError, match=r"term 'bent' is a list of points, which .fis has not"):
        write_fuzzy_file(tmp_path / "a.fis", system)
    assert not (tmp_path / "a.fis").exists()
