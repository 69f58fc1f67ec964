from dataclasses import replace

import pytest
from expression_systems import expression_system

from usdface.correction.rule_check import check_rules, fires_at_neutral
from usdface.expression_system import MarkerFeature
from usdface.findings import Finding
from usdface.fuzzy.rule_parser import parse_rule
from usdface.fuzzy.variables import Term, Variable

TERMS = (
    Term("still", "triangular", (-1, 0, 1)),
    Term("low", "ramp", (-0.1, -0.5)),
    Term("high", "ramp", (0.1, 0.5)),
)


def test_rules_that_fire_at_neutral_or_are_off_are_named() -> None:
    rules = (
        parse_rule("IF c_y IS still THEN joy IS 1"),
        parse_rule("IF c_y IS still AND a_y IS high THEN joy IS 1"),
        parse_rule("IF a_y IS high THEN joy IS 0.5"),
        parse_rule("IF c_y IS still THEN joy IS 0.1", enabled=False),
    )
    variables = (*(Variable(f"{n}_y", "input", TERMS) for n in "ac"), Variable("joy", "output"))
    system = expression_system(variables, rules)
    assert fires_at_neutral(system) == [rules[0]]
    assert [(f.code, f.where) for f in check_rules(system)] == [
        ("RULE_FIRES_AT_NEUTRAL", str(rules[0])),
        ("RULE_OFF", str(rules[3])),
    ]


def test_a_rule_about_a_negative_distance_never_fires() -> None:
    rule = parse_rule("IF a_y IS low THEN joy IS 1")
    variables = Variable("a_y", "input", TERMS), Variable("joy", "output")
    for measure, codes in (("signed", []), ("absolute", ["RULE_UNREACHABLE"])):
        system = expression_system(variables, (rule,), (MarkerFeature("a", "y", measure),))
        assert [f.code for f in check_rules(system)] == codes


@pytest.mark.parametrize(
    ("unit", "term", "is_far"),
    [
        ("marker_spread", Term("raised", "ramp", (0.5, 4.2)), True),
        ("marker_spread", Term("raised", "gaussian", (5.0, 1.0)), True),
        ("marker_spread", Term("raised", "ramp", (0.02, 0.08)), False),
        ("marker_spread", Term("raised", "trapezoidal", (0.02, 0.08, 10.0, 10.0)), False),
        ("marker_spread", Term("raised", "triangular", (0.0101, 0.0104, 0.0107)), False),
        ("marker_spread", Term("raised", "gaussian", (-0.00051, 0.0001)), False),
        ("none", Term("raised", "ramp", (0.5, 4.2)), False),
    ],
)
def test_terms_in_millimetres_in_a_system_in_face_units(
    unit: str, term: Term, is_far: bool
) -> None:
    """The rule base is sound, and the rule never fires as it is meant."""
    rule = parse_rule("IF a_y IS raised THEN joy IS 1")
    variables = Variable("a_y", "input", (term,)), Variable("joy", "output")
    system = replace(expression_system(variables, (rule,)), face_unit=unit)
    far = [f for f in check_rules(system) if f.code == "TERM_FAR"]
    found = [(f.code, f.where, dict(f.values)) for f in far]
    expected = [("TERM_FAR", "a_y", {"names": ["raised"], "variable": "a_y"})]
    assert found == (expected if is_far else [])


@pytest.mark.usefixtures("as_users_have_it")
def test_a_check_that_fails_is_a_finding(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> list[Finding]:
        raise MemoryError

    monkeypatch.setattr("usdface.correction.rule_check.rule_findings", fail)
    variables = Variable("a_y", "input", TERMS), Variable("joy", "output")
    system = expression_system(variables, (parse_rule("IF a_y IS low THEN joy IS 1"),))
    assert [(f.code, f.where) for f in check_rules(system)] == [("ADVICE_FAILED", "fuzzy rules")]
