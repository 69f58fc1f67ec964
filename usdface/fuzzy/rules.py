"""Rules of a fuzzy system: antecedent and consequents."""

from dataclasses import dataclass, field
from typing import Literal, NamedTuple

from usdface.errors import InputError

__all__ = [
    "LONGEST",
    "Combined",
    "Condition",
    "Proposition",
    "Rule",
    "propositions",
    "rule_name",
    "shortened",
]

# Characters of a rule's text in a message.
LONGEST = 400


class Proposition(NamedTuple):
    """``variable IS hedges term``; `hedges` as written, lower-case."""

    variable: str
    term: str
    hedges: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Combined:
    """Conditions joined by AND, OR or MOST OF, or one that is negated."""

    how: Literal["and", "or", "most", "not"]
    parts: tuple["Condition", ...]


Condition = Proposition | Combined


@dataclass(frozen=True, slots=True)
class Rule:
    """One rule, as `parse_rule` makes it.

    Attributes
    ----------
    text : str
        As written.
    antecedent : Proposition or Combined
    consequents : tuple of (output, value)
        The number that the output takes (zero-order Sugeno), or the name of its term.
    weight : float
        In [0, 1]; multiplies the firing strength.
    enabled : bool
    place : str
        Source, for messages: file and line, or prim.
    propositions : tuple of Proposition
        Every proposition of the antecedent, in the order of the text.
    """

    text: str
    antecedent: Condition
    consequents: tuple[tuple[str, float | str], ...]
    weight: float = 1.0
    enabled: bool = True
    place: str = field(default="", compare=False)
    propositions: tuple[Proposition, ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "propositions", tuple(propositions(self.antecedent)))
        if not 0 <= self.weight <= 1:
            raise InputError(f"{self.named}: weight is {self.weight}; expected 0 to 1")

    def __str__(self) -> str:
        return rule_name(self.text)

    @property
    def named(self) -> str:
        """Source and text, as messages begin."""
        return f"{self.place}: rule {self}" if self.place else f"rule {self}"


def propositions(condition: Condition) -> list[Proposition]:
    """Return every proposition of a condition, in the order of the text."""
    if isinstance(condition, Proposition):
        return [condition]
    return [p for part in condition.parts for p in propositions(part)]


def rule_name(text: str) -> str:
    """Return the text in quotes and on one line, as messages show it."""
    return f'"{shortened(" ".join(text.split()))}"'


def shortened(text: str) -> str:
    """Return text as messages show it: cut off where it is longer than `LONGEST`."""
    return text if len(text) <= LONGEST else f"{text[:LONGEST]} ..."
