"""Rules as text for a file, and numbers as terms.

A rule of ours may conclude with a number, a rule of theirs only with a term. A number travels
as a constant term that is called after it, ``value_0_5``, and comes back as a number.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import inf

from usdface.fuzzy.rules import Condition, Proposition, Rule
from usdface.fuzzy.system import FuzzySystem
from usdface.fuzzy.variables import Term, Variable

__all__ = ["as_ramp", "conclusions", "condition_text", "numbers_back", "output_terms"]


def condition_text(condition: Condition, word: Callable[[str], str] = str.upper) -> str:
    """Return a condition as the grammar of `usdface.fuzzy.rules` reads it.

    `word` gives keywords and hedges their case.
    """
    if isinstance(condition, Proposition):
        return " ".join(
            (condition.variable, word("is"), *map(word, condition.hedges), condition.term)
        )
    parts = [condition_text(part, word) for part in condition.parts]
    if condition.how == "not":
        return f"{word('not')} ({parts[0]})"
    if condition.how == "most":
        return f"{word('most')} {word('of')} ({', '.join(parts)})"
    # An AND in an OR needs none, but an AND in an AND does to come back as it was.
    bare = [
        isinstance(part, Proposition)
        or part.how in ("not", "most")
        or (condition.how == "or" and part.how == "and")
        for part in condition.parts
    ]
    parts = [part if plain else f"({part})" for part, plain in zip(parts, bare, strict=True)]
    return f" {word(condition.how)} ".join(parts)


def conclusions(rule: Rule) -> list[tuple[str, str]]:
    """Return the consequents of a rule, each as (output, term)."""
    return [
        (output, value if isinstance(value, str) else _number_term(value).name)
        for output, value in rule.consequents
    ]


def output_terms(system: FuzzySystem, output: Variable) -> tuple[Term, ...]:
    """Return the terms of an output, and those for the numbers that rules give it."""
    numbers = {
        value
        for rule in system.rules
        for name, value in rule.consequents
        if name == output.name and not isinstance(value, str)
    }
    return output.terms + tuple(map(_number_term, sorted(numbers)))


def numbers_back(
    variables: Sequence[Variable], rules: Sequence[Rule]
) -> tuple[tuple[Variable, ...], tuple[Rule, ...]]:
    """Replace terms that are named after their value by numbers, in variables and rules."""
    numbers = {
        (v.name, t.name): t.parameters[0]
        for v in variables
        for t in v.terms
        if t.kind == "constant" and t == _number_term(t.parameters[0])
    }
    kept = tuple(
        replace(v, terms=tuple(t for t in v.terms if (v.name, t.name) not in numbers))
        for v in variables
    )
    return kept, tuple(_renumbered(rule, numbers) for rule in rules)


def _renumbered(rule: Rule, numbers: dict[tuple[str, str], float]) -> Rule:
    values = tuple(
        (output, numbers.get((output, value), value) if isinstance(value, str) else value)
        for output, value in rule.consequents
    )
    ends = [
        f"{name} IS {value if isinstance(value, str) else _plain(value)}" for name, value in values
    ]
    text = f"IF {condition_text(rule.antecedent)} THEN {' AND '.join(ends)}"
    return replace(rule, text=text, consequents=values)


def _plain(value: float) -> str:
    """Return a number as people write it, with all of its digits."""
    short = f"{value:g}"
    return short if float(short) == value else repr(value)


def _number_term(value: float) -> Term:
    name = repr(value).replace(".", "_").replace("-", "m").replace("+", "")
    return Term(f"value_{name.removesuffix('_0')}", "constant", (value,))


def as_ramp(term: Term) -> Term:
    """Return the ramp that a triangle or trapezium with one infinite foot is."""
    if term.kind not in ("triangular", "trapezoidal"):
        return term
    p = term.parameters
    if p[0] == -inf and p[-2] < p[-1] < inf:
        return Term(term.name, "ramp", (p[-1], p[-2]))
    if p[-1] == inf and -inf < p[0] < p[1]:
        return Term(term.name, "ramp", (p[0], p[1]))
    return term
