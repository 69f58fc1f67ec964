import pytest

from usdface.errors import InputError
from usdface.fuzzy.rule_parser import parse_rule


def test_a_rule_says_what_it_says():
    rule = parse_rule("if a_y is HIGH\n and b Is low then joy IS 1 AND fear is 0.25", 0.5, False)
    assert [(p.variable, p.term) for p in rule.propositions] == [("a_y", "HIGH"), ("b", "low")]
    assert rule.consequents == (("joy", 1.0), ("fear", 0.25))
    assert (rule.weight, rule.enabled) == (0.5, False)


def test_its_text_is_kept_as_written():
    text = "  IF a IS high\tTHEN joy IS 1 "
    assert parse_rule(text).text == text


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "line 1, column 1: expected IF, found the end"),
        ("WHEN a IS b THEN c IS 1", "line 1, column 1: expected IF, found WHEN"),
        ("IF a = b THEN c IS 1", "line 1, column 6: expected IS, found ="),
        (
            "IF a IS b\n  XOR d IS e THEN c IS 1",
            "line 2, column 3: expected AND, OR or THEN, found X",
        ),
        ("IF (a IS b THEN c IS 1", r"column 12: expected AND, OR or \), found THEN"),
        ("IF a IS b) THEN c IS 1", r"column 10: expected AND, OR or THEN, found \)"),
        ("IF a IS (b) THEN c IS 1", r"column 9: expected a term, found \("),
        ("IF a IS b OR THEN c IS 1", "column 14: expected a variable, found THEN"),
        (f"IF {'(' * 40}a IS b", "column 36: expected at most 32 parentheses"),
        ("IF a IS THEN c IS 1", "line 1, column 9: expected a term, found THEN"),
        ("IF IS high THEN c IS 1", "line 1, column 4: expected a variable, found IS"),
        ("IF a IS b THEN c IS AND", "line 1, column 21: expected a number or a term, found AND"),
        ("IF a IS b THEN c IS nan", "line 1, column 21: expected a finite number"),
        ("IF a IS b", "line 1, column 10: expected AND, OR or THEN, found the end of the rule"),
        ("IF a IS b THEN\n", "line 2, column 1: expected an output, found the end"),
        ("IF a IS b THEN c IS very d", "column 21: expected a number or a term without a hedge"),
        (f"IF a IS {'very ' * 9}b THEN c IS 1", "column 49: expected at most 8 hedges, found very"),
        ("IF a IS b THEN c IS 1 2", "column 23: expected AND or the end of the rule, found 2"),
    ],
)
def test_errors_name_line_column_and_what_was_expected(text, says):
    with pytest.raises(InputError, match=says.replace("\n", " ")) as error:
        parse_rule(text)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("weight", [-0.1, 1.5, float("nan")])
def test_a_weight_lies_between_0_and_1(weight):
    with pytest.raises(InputError, match="weight"):
        parse_rule("IF a IS b THEN c IS 1", weight)


def test_most_of_counts_its_conditions():
    rule = parse_rule("IF most Of (a IS b, c IS NOT d , (e IS f OR g IS h)) AND i IS j THEN k IS 1")
    most, other = rule.antecedent.parts
    assert most.how == "most" and len(most.parts) == 3 and most.parts[2].how == "or"
    assert other.variable == "i"


def test_a_variable_may_be_called_most():
    (only,) = parse_rule("IF most IS of THEN a IS 1").propositions
    assert (only.variable, only.term) == ("most", "of")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("IF MOST OF a IS b THEN c IS 1", r"column 12: expected \( after MOST OF, found a"),
        ("IF MOST OF (a IS b,) THEN c IS 1", r"column 20: expected a variable, found \)"),
        ("IF MOST OF (a IS b THEN c IS 1", r"column 20: expected AND, OR, , or \), found THEN"),
        ("IF a IS b, THEN c IS 1", "column 10: expected AND, OR or THEN, found ,"),
    ],
)
def test_what_breaks_most_of_is_pointed_at(text, says):
    with pytest.raises(InputError, match=says):
        parse_rule(text)
