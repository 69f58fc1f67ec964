import pytest

from usdface.fuzzy.lint import rule_findings
from usdface.fuzzy.rule_parser import parse_rule
from usdface.fuzzy.system import FuzzySystem
from usdface.fuzzy.variables import Term, Variable

LOW = Term("low", "ramp", (-0.1, -0.5))
HIGH = Term("high", "ramp", (0.1, 0.5))


def found(*texts, range_=None):
    variables = (
        Variable("a", "input", terms=(LOW, HIGH), range=range_),
        Variable("b", "input", terms=(LOW, HIGH)),
        Variable("joy", "output"),
    )
    system = FuzzySystem(variables, tuple(map(parse_rule, texts)))
    return [(f.code, f.where) for f in rule_findings(system)]


@pytest.mark.parametrize(
    ("condition", "fires"),
    [
        ("a IS high AND a IS low", False),
        ("a IS high AND b IS low", True),
        ("a IS high AND (a IS low OR b IS low)", True),
        ("(a IS high OR b IS high) AND a IS low AND b IS low", False),
        ("a IS high AND NOT (a IS low OR b IS low)", True),
        ("MOST OF (a IS high, b IS high, a IS low AND a IS high)", True),
        ("MOST OF (a IS high, a IS low AND a IS high, b IS low AND b IS high)", False),
        ("NOT (MOST OF (a IS high, b IS high, b IS low))", True),
        ("a IS very high AND NOT (a IS low OR a IS not low)", False),
        (" AND ".join(["(a IS high OR a IS low OR b IS high)"] * 12), True),
    ],
)
def test_a_rule_that_can_never_fire_is_named(condition, fires):
    rule = f"IF {condition} THEN joy IS 1"
    expected = [] if fires else [("RULE_UNREACHABLE", str(parse_rule(rule)))]
    assert found(rule) == expected


def test_a_term_beyond_the_range_of_its_input_makes_a_rule_that_never_fires():
    rule = "IF a IS high AND b IS high THEN joy IS 1"
    assert found(rule) == found(rule, range_=(0.05, 1.0))[1:] == []
    codes = [code for code, _ in found(rule, range_=(-0.9, 0.1))]
    assert "RULE_UNREACHABLE" in codes
    assert "RULE_UNREACHABLE" not in [code for code, _ in found(rule, range_=(-0.9, 0.11))]


def test_a_rule_that_is_switched_off_is_meant_to_be():
    """It is said, but is no warning, and what it asks for is not looked at."""
    never = "IF a IS high AND a IS low THEN joy IS 1"
    for off in ({"enabled": False}, {"weight": 0.0}):
        system = FuzzySystem(
            (Variable("a", "input", terms=(LOW, HIGH)), Variable("joy", "output")),
            (parse_rule(never, **off),),
        )
        (reported,) = rule_findings(system)
        assert (reported.code, reported.severity) == ("RULE_OFF", "info")


def test_contradictory_rules_are_named_whatever_their_order():
    one, other = (
        "IF a IS high AND b IS low THEN joy IS 1",
        "IF b IS low AND a IS high THEN joy IS 0.2",
    )
    assert found(one, other) == [("RULES_CONTRADICT", f'"{other}"')]
    assert found(one, one) == []
    assert found(one, other.replace("AND a IS high", "AND a IS low")) == []


def test_what_no_term_covers_is_named():
    rule = "IF a IS high THEN joy IS 1"
    assert found(rule) == []
    assert found(rule, range_=(0.2, 1.0)) == []
    assert found(rule, range_=(-1, 1)) == [("RANGE_UNCOVERED", "a")]


def test_each_gap_of_a_range_is_named_for_itself():
    terms = (
        Term("low", "trapezoidal", (0.0, 0.0, 1.0, 3.0)),
        Term("high", "trapezoidal", (7.0, 9.0, 9.5, 9.8)),
    )
    variables = (Variable("a", "input", terms=terms, range=(0, 10)), Variable("joy", "output"))
    rules = (parse_rule("IF a IS high THEN joy IS 1"),)
    (gap,) = (
        f for f in rule_findings(FuzzySystem(variables, rules)) if f.code == "RANGE_UNCOVERED"
    )
    assert gap.message.startswith("no term of a covers 3 to 7, 9.8 to 10; ")


@pytest.mark.slow
def test_every_rule_is_compared_with_the_first_that_asks_for_the_same():
    texts = [f"IF a IS high THEN joy IS {n / 5000}" for n in range(5000)]
    codes = found(*texts)
    assert codes == [("RULES_CONTRADICT", f'"{text}"') for text in texts[1:]]
    assert found(*texts[:1] * 5000) == []


def test_an_output_that_no_rule_concludes_is_named():
    """A file that is cut off before its rules was read without a word, and corrected nothing."""
    output = Variable("joy", "output"), Variable("fear", "output")
    variables = (Variable("a", "input", terms=(LOW, HIGH)), *output)
    for texts, names in (((), ["joy", "fear"]), (("IF a IS high THEN joy IS 1",), ["fear"])):
        system = FuzzySystem(variables, tuple(map(parse_rule, texts)))
        (each,) = rule_findings(system)
        assert (each.code, each.values["names"]) == ("OUTPUT_WITHOUT_RULE", names)
