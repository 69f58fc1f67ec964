"""Linguistic variables: inputs and outputs with a range and terms."""

from collections.abc import Iterable
from dataclasses import dataclass
from math import isfinite
from typing import Any, Literal, get_args

from usdface.errors import InputError
from usdface.fuzzy.membership import check_parameters
from usdface.fuzzy.rule_parser import KEYWORDS

__all__ = ["Term", "Variable", "VariableKind", "check_choice", "check_counts", "check_unique"]

VariableKind = Literal["input", "output"]

# More are not legible, and the firing strength of each is kept for every frame.
_MOST_RULES = 10_000
_MOST_VARIABLES = _MOST_TERMS = 1_000


def check_choice(subject: str, value: object, choices: Any) -> None:
    """Refuse a setting that is not one of the strings of a Literal.

    Raises
    ------
    InputError
        With the choices.
    """
    if value not in get_args(choices):
        raise InputError(f"{subject} is {value!r}; expected {' or '.join(get_args(choices))}")


def check_counts(variables: int = 0, terms: int = 0, rules: int = 0) -> None:
    """Refuse too many variables, terms of one of them, or rules.

    Raises
    ------
    InputError
        With the number and the most.
    """
    counts = (
        ("variables", variables, _MOST_VARIABLES),
        ("terms of one variable", terms, _MOST_TERMS),
        ("rules", rules, _MOST_RULES),
    )
    for subject, count, most in counts:
        if count > most:
            raise InputError(f"the fuzzy system has {count} {subject}; expected at most {most}")


def check_unique(subject: str, names: Iterable[str]) -> None:
    """Refuse a name that occurs twice.

    Raises
    ------
    InputError
        With the name.
    """
    seen: set[str] = set()
    for name in names:
        if name in seen:
            raise InputError(f"{subject} {name!r} occurs twice; names must be unique")
        seen.add(name)


@dataclass(frozen=True, slots=True)
class Term:
    """One linguistic value of a variable: a membership function with a name.

    Of a Sugeno system's output it is a "constant", or "linear": a factor for each input, in
    their order, then the constant.
    """

    name: str
    kind: str
    parameters: tuple[float, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "parameters", tuple(map(float, self.parameters)))
        odd = self.name[:1] == "(" or self.name.count(")") > self.name.count("(")
        odd |= self.name.endswith(",")
        if odd or self.name.split() != [self.name] or self.name.upper() in KEYWORDS:
            raise InputError(f"a term cannot be called {self.name!r}; rules need a single word")
        try:
            check_parameters(self.kind, self.parameters)
        except InputError as error:
            raise InputError(f"term {self.name!r}: {error}") from None


@dataclass(frozen=True, slots=True)
class Variable:
    """A linguistic variable: an input or an output of a system.

    Attributes
    ----------
    name : str
        An identifier; rules use it.
    kind : {"input", "output"}
    terms : tuple of Term
        An output needs none where its rules give numbers.
    range : (low, high), optional
        An output's values stay in it: [0, 1] where there is none. Of an input: the
        values its terms should cover; others are not clipped.
    default : float
        Output only: its value where no rule fires.

    Raises
    ------
    InputError
        If a name cannot stand in a rule, two terms share one, or the range or default is wrong.
    """

    name: str
    kind: VariableKind
    terms: tuple[Term, ...] = ()
    range: tuple[float, float] | None = None
    default: float = 0.0

    def __post_init__(self) -> None:
        if not self.name.isidentifier() or self.name.upper() in KEYWORDS:
            raise InputError(
                f"a fuzzy variable cannot be called {self.name!r}; expected one word of letters, "
                f"digits and _, and none of {', '.join(KEYWORDS)}"
            )
        where = f"fuzzy variable {self.name!r}"
        check_choice(f"{where}: kind", self.kind, VariableKind)
        check_counts(terms=len(self.terms))
        check_unique(f"{where}: term", (term.name for term in self.terms))
        object.__setattr__(self, "default", float(self.default))
        if self.range is not None:
            object.__setattr__(self, "range", tuple(map(float, self.range)))
            if not (all(map(isfinite, self.range)) and self.range[0] < self.range[1]):
                raise InputError(f"{where}: range {self.range}; expected a lower, then a higher")
        low, high = self.span
        if self.kind == "output" and not low <= self.default <= high:
            raise InputError(f"{where}: default {self.default} lies outside {low:g} to {high:g}")

    @property
    def span(self) -> tuple[float, float]:
        """The range, or [0, 1] where there is none."""
        return self.range or (0.0, 1.0)

    def term(self, name: str) -> Term:
        """Return the term of that name (the system has checked that its rules' exist)."""
        return next(term for term in self.terms if term.name == name)
