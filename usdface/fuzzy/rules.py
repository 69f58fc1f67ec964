"""Rules: one line of text each, and what it says.

::

    rule       = "IF" condition { "AND" condition } "THEN" conclusion { "AND" conclusion }
    condition  = variable "IS" term
    conclusion = output "IS" number

Keywords in any case; names are case-sensitive and free of white space.
"""

import re
from dataclasses import dataclass
from math import isfinite

from usdface.errors import InputError

__all__ = ["KEYWORDS", "Rule", "parse_rule"]

KEYWORDS = ("IF", "IS", "AND", "THEN")


@dataclass(frozen=True, slots=True)
class Rule:
    """One rule, as `parse_rule` makes it.

    Attributes
    ----------
    text : str
        As written.
    antecedent : tuple of (variable, term)
        All must hold.
    consequents : tuple of (output, value)
        Zero-order Sugeno: the value the output takes, in [0, 1].
    weight : float
        In [0, 1]; multiplies the firing strength.
    enabled : bool
    """

    text: str
    antecedent: tuple[tuple[str, str], ...]
    consequents: tuple[tuple[str, float], ...]
    weight: float = 1.0
    enabled: bool = True

    def __post_init__(self) -> None:
        if not 0 <= self.weight <= 1:
            raise InputError(f"rule {self}: weight is {self.weight}; expected 0 to 1")

    def __str__(self) -> str:
        return _quoted(self.text)


def parse_rule(text: str, weight: float = 1.0, enabled: bool = True) -> Rule:
    """Read a rule.

    Parameters
    ----------
    text : str
        ``IF mouth_left_y IS raised AND cheek_left_y IS raised THEN joy IS 1``.
    weight : float
        In [0, 1].
    enabled : bool

    Raises
    ------
    InputError
        Where the text departs from the grammar, with line, column and what was expected.
    """
    words = _Words(text)
    words.keyword("IF")
    antecedent = [words.condition()]
    while words.keyword("AND", "THEN") == "AND":
        antecedent.append(words.condition())
    consequents = [words.conclusion()]
    while words.keyword("AND", "") == "AND":
        consequents.append(words.conclusion())
    return Rule(text, tuple(antecedent), tuple(consequents), float(weight), bool(enabled))


def _quoted(text: str) -> str:
    """The text in quotes and on one line, as messages show it."""
    return f'"{" ".join(text.split())}"'


class _Words:
    """The words of a rule, taken one after the other."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._rest = list(re.finditer(r"\S+", text))[::-1]

    def condition(self) -> tuple[str, str]:
        variable = self._name("a variable")
        self.keyword("IS")
        return variable, self._name("a term")

    def conclusion(self) -> tuple[str, float]:
        output = self._name("an output")
        self.keyword("IS")
        at, word = self._next()
        try:
            value = float(word)
        except ValueError:
            raise self._error(at, "a number", word) from None
        if not isfinite(value):
            raise self._error(at, "a finite number", word)
        return output, value

    def keyword(self, *expected: str) -> str:
        """Take one of the keywords; "" stands for the end of the rule."""
        at, word = self._next()
        if word.upper() not in expected:
            raise self._error(at, " or ".join(e or "the end of the rule" for e in expected), word)
        return word.upper()

    def _name(self, what: str) -> str:
        at, word = self._next()
        if not word or word.upper() in KEYWORDS:
            raise self._error(at, what, word)
        return word

    def _next(self) -> tuple[int, str]:
        if not self._rest:
            return len(self._text), ""
        match = self._rest.pop()
        return match.start(), match.group()

    def _error(self, at: int, expected: str, found: str) -> InputError:
        line = self._text.count("\n", 0, at) + 1
        column = at - self._text.rfind("\n", 0, at)
        return InputError(
            f"rule {_quoted(self._text)}, line {line}, column {column}: "
            f"expected {expected}, found {found or 'the end of the rule'}"
        )
