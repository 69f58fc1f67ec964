import pytest

from usdface.errors import InputError
from usdface.fuzzy.rule_parser import parse_rule
from usdface.fuzzy.system import FuzzySystem
from usdface.fuzzy.variables import Term, Variable

HIGH = Term("high", "ramp", (0, 1))
A = Variable("a", "input", (HIGH,))
JOY = Variable("joy", "output")


def system(*rules, variables=(A, JOY), **settings):
    return FuzzySystem(variables, tuple(map(parse_rule, rules)), **settings)


def test_inputs_and_outputs_keep_the_order_of_the_variables():
    b = Variable("b", "input")
    fear = Variable("fear", "output")
    mixed = system(variables=(fear, b, JOY, A))
    assert [v.name for v in mixed.inputs] == ["b", "a"]
    assert mixed.output_names == ("fear", "joy")


@pytest.mark.parametrize(
    ("rule", "says"),
    [
        ("IF b IS high THEN joy IS 1", "no input is called 'b'; there are a"),
        ("IF a IS low THEN joy IS 1", "a has no term 'low'; it has high"),
        ("IF a IS high THEN bliss IS 1", "no output is called 'bliss'; there are joy"),
        ("IF a IS high THEN joy IS 2", "joy IS 2; expected 0 to 1"),
        ("IF a IS high THEN joy IS 1 AND joy IS 0", "occurs twice"),
    ],
)
def test_rules_may_only_name_what_is_there(rule, says):
    with pytest.raises(InputError, match=says) as error:
        system(rule)
    assert rule in str(error.value)


@pytest.mark.parametrize(
    "settings",
    [
        {"normalisation": "none"},
        {"and_": "max"},
        {"or_": "min"},
        {"samples": 1},
        {"variables": (A, A, JOY)},
    ],
)
def test_settings_are_checked(settings):
    with pytest.raises(InputError):
        system(**settings)


def test_a_misspelled_input_is_said_with_the_nearest() -> None:
    """A face has forty inputs, more than one reads in a message."""
    chin = Variable("chin_y", "input", (HIGH,))
    with pytest.raises(InputError, match=r"add the input; did you mean chin_y\?"):
        system("IF chim_y IS high THEN joy IS 1", variables=(chin, JOY))


def test_more_rules_than_anybody_reads_are_refused():
    brow = Variable("a", "input", terms=(Term("on", "ramp", (0, 1)),))
    rules = (parse_rule("IF a IS on THEN joy IS 1"),) * 10_001
    with pytest.raises(InputError, match="10001 rules; expected at most 10000"):
        FuzzySystem((brow, Variable("joy", "output")), rules)


def test_a_rule_that_asks_for_an_output_is_refused():
    brow = Variable("a", "input", terms=(Term("on", "ramp", (0, 1)),))
    rule = parse_rule("IF joy IS on THEN fear IS 1")
    with pytest.raises(InputError, match="'joy' is an output; a rule asks for inputs alone, a"):
        FuzzySystem((brow, Variable("joy", "output"), Variable("fear", "output")), (rule,))


def test_more_variables_than_anybody_reads_are_refused():
    many = tuple(Variable(f"v{i}", "input") for i in range(1001))
    with pytest.raises(InputError, match="1001 variables; expected at most 1000"):
        FuzzySystem(many, ())
