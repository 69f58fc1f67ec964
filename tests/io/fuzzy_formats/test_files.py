"""What our systems hold comes back from every format, and means the same."""

from dataclasses import MISSING, fields
from math import inf

import numpy as np
import pytest
from every_term import BROW, FORMATS, LIP, READS, SYSTEMS, both_ways
from expression_systems import expression_system
from pxr import Usd

from usdface.errors import InputError, OutputError
from usdface.fuzzy.inference import evaluate
from usdface.fuzzy.rule_parser import parse_rule
from usdface.fuzzy.variables import Term, Variable
from usdface.io.fuzzy_formats.files import read_fuzzy_file, write_fuzzy_file
from usdface.io.usd.fuzzy import write_fuzzy
from usdface.rule_design.paper_system import paper_system


@pytest.mark.parametrize("suffix", FORMATS)
@pytest.mark.parametrize("name", SYSTEMS)
def test_every_format_gives_back_what_it_was_given(tmp_path, name, suffix):
    found, _ = both_ways(tmp_path, SYSTEMS[name], suffix)
    assert found == SYSTEMS[name]


@pytest.mark.parametrize("part", [lambda system: system, lambda system: system.fuzzy])
def test_every_setting_is_among_what_is_given(part):
    """A new one is forgotten by no format."""
    settings = [each for each in fields(part(SYSTEMS["default"])) if each.default is not MISSING]
    held = [part(system) for system in SYSTEMS.values()]
    usual = [s.name for s in settings if all(getattr(h, s.name) == s.default for h in held)]
    assert not usual, "give one of tests/every_term.py another value"


@pytest.mark.parametrize("suffix", FORMATS)
def test_the_papers_system_means_the_same(tmp_path, suffix):
    system = paper_system()
    found, _ = both_ways(tmp_path, system, suffix)
    inputs = np.random.default_rng(0).uniform(-1, 3, (200, len(system.features)))
    np.testing.assert_array_equal(
        evaluate(found.fuzzy, inputs).outputs, evaluate(system.fuzzy, inputs).outputs
    )
    assert found.features == system.features
    again, _ = both_ways(tmp_path, found, suffix)
    assert again == found


@pytest.mark.parametrize("suffix", (".fcl", ".fll", ".usda"))
def test_hedges_and_parentheses(tmp_path, suffix):
    text = (
        "IF (brow_y IS VERY up OR lip_x IS NOT SOMEWHAT up) AND brow_y IS EXTREMELY s THEN joy IS 1"
    )
    system = expression_system((BROW, LIP, Variable("joy", "output")), (parse_rule(text),), READS)
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
    system = expression_system((BROW, LIP, Variable("joy", "output")), (parse_rule(rule),), READS)
    for suffix in suffixes:
        with pytest.raises(OutputError, match=says) as error:
            write_fuzzy_file(tmp_path / f"a{suffix}", system)
        assert rule in str(error.value)
        assert not (tmp_path / f"a{suffix}").exists()


def test_not_before_parentheses_travels_in_fcl(tmp_path):
    rule = parse_rule("IF NOT (brow_y IS up OR lip_x IS up) THEN joy IS 1")
    system = expression_system((BROW, LIP, Variable("joy", "output")), (rule,), READS)
    assert both_ways(tmp_path, system, ".fcl")[0] == system


def test_a_term_that_a_format_has_no_name_for_is_refused(tmp_path):
    term = Term("far(left)", "ramp", (0, 1))
    system = expression_system((Variable("a", "input", terms=(term,)),), ())
    for suffix in (".fis", ".fcl", ".fll"):
        with pytest.raises(OutputError, match=r"far\(left\).*rename it"):
            write_fuzzy_file(tmp_path / f"a{suffix}", system)


def test_infinite_feet(tmp_path):
    terms = (
        Term("left", "triangular", (-inf, 0, 1)),
        Term("right", "trapezoidal", (0, 1, 2, inf)),
        Term("all", "triangular", (-inf, 0, inf)),
    )
    variable = Variable("a_x", "input", terms=terms)
    rules = tuple(parse_rule(f"IF a_x IS {t.name} THEN joy IS 1") for t in terms)
    system = expression_system((variable, Variable("joy", "output")), rules)
    x = np.linspace(-2, 3, 101)[:, None]
    for suffix in (".fis", ".fcl", ".fll"):
        found, _ = both_ways(tmp_path, system, suffix)
        np.testing.assert_array_equal(
            evaluate(found.fuzzy, x).firing, evaluate(system.fuzzy, x).firing
        )


def test_other_suffixes_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"\.fis"):
        read_fuzzy_file(tmp_path / "a.json")
    with pytest.raises(OutputError, match=r"\.fis"):
        write_fuzzy_file(tmp_path / "a.json", SYSTEMS["default"])


def test_usd_holds_exactly_one_system(tmp_path):
    stage = Usd.Stage.CreateNew(str(tmp_path / "two.usda"))
    with pytest.raises(InputError, match="expected one UsdFaceFuzzySystem, found none"):
        read_fuzzy_file(tmp_path / "two.usda")
    for path in ("/A", "/B"):
        write_fuzzy(stage, path, SYSTEMS["default"])
    stage.Save()
    with pytest.raises(InputError, match="found /A, /B"):
        read_fuzzy_file(tmp_path / "two.usda")


def test_a_list_of_points_is_refused_where_a_format_has_none(tmp_path):
    terms = (Term("bent", "points", (0, 0, 1, 0.3, 2, 1)),)
    brow = Variable("brow_y", "input", terms=terms)
    rule = parse_rule("IF brow_y IS bent THEN joy IS 1")
    system = expression_system((brow, Variable("joy", "output")), (rule,))
    with pytest.raises(OutputError, match=r"term 'bent' is a list of points, which .fis has not"):
        write_fuzzy_file(tmp_path / "a.fis", system)
    assert not (tmp_path / "a.fis").exists()


@pytest.mark.parametrize("suffix", FORMATS)
def test_most_of_is_refused_where_no_program_knows_it(tmp_path, suffix):
    term = Term("high", "ramp", (0.0, 1.0))
    variables = tuple(Variable(n, "input", (term,)) for n in "abc")
    rule = parse_rule("IF MOST OF (a IS high, b IS high, c IS high) THEN joy IS 1")
    system = expression_system((*variables, Variable("joy", "output")), (rule,))
    file = tmp_path / f"most{suffix}"
    if suffix.startswith(".usd"):
        write_fuzzy_file(file, system)
        assert read_fuzzy_file(file)[0].fuzzy.rules[0].antecedent == rule.antecedent
    else:
        with pytest.raises(OutputError, match="MOST OF") as error:
            write_fuzzy_file(file, system)
        assert suffix in str(error.value) and not file.exists()


@pytest.mark.parametrize("suffix", FORMATS)
def test_a_system_that_is_not_there_is_unreadable_in_every_format(tmp_path, suffix):
    """As any other file: a program tells it from one with a wrong content."""
    with pytest.raises(InputError) as caught:
        read_fuzzy_file(tmp_path / f"gone{suffix}")
    assert caught.value.code == "FILE_UNREADABLE"


def test_what_a_usd_file_holds_in_vain_is_reported_with_the_file(tmp_path):
    path = tmp_path / "mine.usda"
    write_fuzzy_file(path, paper_system())
    text = path.read_text()
    assert read_fuzzy_file(path)[1] == []
    path.write_text(text.replace("usdface:blendTime", "usdface:blend_time"))
    (found,) = read_fuzzy_file(path)[1]
    assert (found.code, found.where) == ("SETTING_UNREAD", f"{path}: </Fuzzy>.usdface:blend_time")
    path.write_text(text.replace('def UsdFaceFuzzyRule "rule_01"', 'def UsdFaceRule "rule_01"'))
    (found,) = read_fuzzy_file(path)[1]
    assert found.where.endswith("</Fuzzy/rule_01>") and "ignored" in found.message
