import pytest

from usdface.errors import InputError
from usdface.fuzzy.variables import Term, Variable

HIGH = Term("high", "ramp", (0, 1))


@pytest.mark.parametrize(
    "make",
    [
        lambda: Variable("two words", "input"),
        lambda: Variable("then", "input"),
        lambda: Variable("a", "sideways"),
        lambda: Variable("a", "input", (HIGH, HIGH)),
        lambda: Variable("a", "input", range=(1, 1)),
        lambda: Variable("a", "output", default=2),
        lambda: Term("", "ramp", (0, 1)),
        lambda: Term("very high", "ramp", (0, 1)),
        lambda: Term("high", "ramp", (1, 1)),
    ],
)
def test_variables_and_terms_are_checked(make):
    with pytest.raises(InputError):
        make()


def test_more_terms_than_anybody_reads_are_refused():
    terms = tuple(Term(f"t{i}", "ramp", (0, 1)) for i in range(1001))
    with pytest.raises(InputError, match="1001 terms of one variable; expected at most 1000"):
        Variable("a", "input", terms=terms)


def test_the_range_of_an_output_is_0_to_1_where_it_has_none():
    assert Variable("a", "output").span == (0, 1)
    assert Variable("a", "output", range=(-2, 3)).span == (-2, 3)
