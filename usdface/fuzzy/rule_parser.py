"""Rules as text: their grammar, and the parser.

::

    rule       = "IF" any "THEN" conclusion { "AND" conclusion }
    any        = all { "OR" all }
    all        = condition { "AND" condition }
    condition  = [ "NOT" ] ( "(" any ")" | most | variable "IS" { hedge } term )
    most       = "MOST" "OF" "(" any { "," any } ")"
    conclusion = output "IS" ( number | term )
    hedge      = "NOT" | "VERY" | "SOMEWHAT" | "EXTREMELY" | "SELDOM"

AND binds stronger than OR. Keywords in any case; names are case-sensitive and free of white
space. Of several hedges the one next to the term comes first. A hedge's word may be a term: it is
one where no name follows. ``MOST OF (a IS high, b IS high, c IS high)`` holds as far as most of its
conditions do, see `usdface.fuzzy.norms.most_of`.
"""

import re
from collections.abc import Callable
from math import isfinite
from typing import Literal

from usdface.errors import InputError
from usdface.fuzzy.norms import HEDGES
from usdface.fuzzy.rules import LONGEST, Combined, Condition, Proposition, Rule, shortened

__all__ = ["KEYWORDS", "parse_rule"]

KEYWORDS = ("IF", "IS", "AND", "OR", "NOT", "THEN")
_MARKS = ("(", ")", ",")
# Deeper nesting would exhaust the stack.
_DEEPEST = 32
# Hedges of one term.
_MOST_HEDGES = 8


def parse_rule(text: str, weight: float = 1.0, enabled: bool = True, place: str = "") -> Rule:
    """Read a rule.

    Parameters
    ----------
    text : str
        ``IF mouth_left_y IS very raised AND cheek_left_y IS raised THEN joy IS 1``.
    weight : float
        In [0, 1].
    enabled : bool
    place : str
        Source, for messages.

    Raises
    ------
    InputError
        If the text breaks the grammar; with line, column and the expected word.
    """
    words = _Words(text)
    words.keyword("IF")
    condition = words.any()
    words.keyword("AND", "OR", "THEN")
    consequents = [words.conclusion()]
    while words.keyword("AND", "") == "AND":
        consequents.append(words.conclusion())
    return Rule(text, condition, tuple(consequents), float(weight), bool(enabled), place)


class _Words:
    """The words of a rule, taken one after the other."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._rest: list[tuple[int, str]] = []
        for match in re.finditer(r"\S+", text):
            self._rest += _without_parentheses(match.start(), match.group())
        self._rest.reverse()
        self._depth = 0

    def any(self) -> Condition:
        return self._joined("or", lambda: self._joined("and", self._condition))

    def _joined(self, how: Literal["and", "or"], part: Callable[[], Condition]) -> Condition:
        parts = [part()]
        while self._ahead() == how.upper():
            self._rest.pop()
            parts.append(part())
        return parts[0] if len(parts) == 1 else Combined(how, tuple(parts))

    def _condition(self) -> Condition:
        negated = self._ahead() == "NOT"
        if negated:
            self._rest.pop()
        found = self._part()
        if not negated:
            return found
        if isinstance(found, Proposition):
            return Proposition(found.variable, found.term, ("not", *found.hedges))
        return Combined("not", (found,))

    def _part(self) -> Condition:
        if self._ahead() == "(":
            return self._group("AND", "OR")[0]
        if self._ahead() == "MOST" and self._after() == "OF":
            del self._rest[-2:]
            if self._ahead() != "(":
                at, word = self._next()
                raise self._error(at, "( after MOST OF", word)
            return Combined("most", tuple(self._group("AND", "OR", ",")))
        return self._proposition()

    def _group(self, *joining: str) -> list[Condition]:
        """Take conditions in parentheses, several where a comma is among the words that join."""
        at, word = self._next()
        self._depth += 1
        if self._depth > _DEEPEST:
            raise self._error(at, f"at most {_DEEPEST} parentheses in one another", word)
        found = [self.any()]
        while self.keyword(*joining, ")") == ",":
            found.append(self.any())
        self._depth -= 1
        return found

    def _proposition(self) -> Proposition:
        variable = self._name("a variable")
        self.keyword("IS")
        hedges = []
        while (word := self._ahead().lower()) in HEDGES and (word == "not" or self._names_on()):
            at, _ = self._rest.pop()
            hedges.append(word)
            if len(hedges) > _MOST_HEDGES:
                raise self._error(at, f"at most {_MOST_HEDGES} hedges", word)
        return Proposition(variable, self._name("a term"), tuple(hedges))

    def conclusion(self) -> tuple[str, float | str]:
        output = self._name("an output")
        self.keyword("IS")
        at, word = self._next()
        try:
            value = float(word)
        except ValueError:
            if not word or word.upper() in (*KEYWORDS, *_MARKS):
                raise self._error(at, "a number or a term", word) from None
            if word.lower() in HEDGES and self._names_next():
                raise self._error(at, "a number or a term without a hedge", word) from None
            return output, word
        if not isfinite(value):
            raise self._error(at, "a finite number", word)
        return output, value

    def keyword(self, *expected: str) -> str:
        """Take one of the keywords; "" is the end of the rule.

        AND and OR before another keyword are for the message only: a condition has taken all of
        them.
        """
        at, word = self._next()
        if word.upper() not in expected:
            *others, last = [e or "the end of the rule" for e in expected]
            names = f"{', '.join(others)} or {last}" if others else last
            raise self._error(at, names, word)
        return word.upper()

    def _name(self, expected: str) -> str:
        at, word = self._next()
        if not word or word.upper() in (*KEYWORDS, *_MARKS):
            raise self._error(at, expected, word)
        return word

    def _ahead(self) -> str:
        return self._rest[-1][1].upper() if self._rest else ""

    def _after(self) -> str:
        return self._rest[-2][1].upper() if len(self._rest) > 1 else ""

    def _names_on(self) -> bool:
        """Whether the word after the next is a name or a NOT."""
        after = self._after() or ")"
        return after == "NOT" or after not in (*KEYWORDS, *_MARKS)

    def _names_next(self) -> bool:
        """Whether the next word is a name."""
        ahead = self._ahead()
        return bool(ahead) and ahead not in (*KEYWORDS, *_MARKS)

    def _next(self) -> tuple[int, str]:
        return self._rest.pop() if self._rest else (len(self._text), "")

    def _error(self, at: int, expected: str, found: str) -> InputError:
        line = self._text.count("\n", 0, at) + 1
        column = at - self._text.rfind("\n", 0, at)
        return InputError(
            f"rule {self._around(at)}, line {line}, column {column}: "
            f"expected {expected}, found {shortened(found) or 'the end of the rule'}"
        )

    def _around(self, at: int) -> str:
        """Return the text in quotes; of a long one, the part around a position."""
        begin = max(0, at - LONGEST // 2) if len(self._text) > LONGEST else 0
        part = self._text[begin : begin + LONGEST]
        before = "... " if begin else ""
        after = " ..." if begin + LONGEST < len(self._text) else ""
        return f'"{before}{" ".join(part.split())}{after}"'


def _without_parentheses(at: int, word: str) -> list[tuple[int, str]]:
    """Split off parentheses around a word and commas behind; those inside it are its own.

    As in ``far(left)`` and ``0,5``.
    """
    name = word.lstrip("(")
    opened = len(word) - len(name)
    # A bracket behind the name is its own where one in it is open.
    closed = len(name)
    while closed and (name[closed - 1] == "," or _closes(name[:closed])):
        closed -= 1
    behind = enumerate(name[closed:], start=at + opened + closed)
    return [
        *((at + i, "(") for i in range(opened)),
        *([(at + opened, name[:closed])] if closed else []),
        *behind,
    ]


def _closes(name: str) -> bool:
    return name.endswith(")") and name.count(")") > name.count("(")
