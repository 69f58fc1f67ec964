"""Terms of FCL: lists of points, singletons, and the words of fuzzylite and jFuzzyLogic."""

import re
from collections.abc import Mapping
from math import inf
from types import MappingProxyType

from usdface.errors import InputError
from usdface.fuzzy.variables import Term
from usdface.io.fuzzy_formats.fcl_keywords import JFUZZY
from usdface.io.fuzzy_formats.fll_keywords import FLL_KINDS

__all__ = ["known", "number", "read_term"]


def read_term(name: str, words: tuple[str, ...]) -> Term:
    """Return a term from the text after its `:=`.

    Raises
    ------
    InputError
        If our systems have no such term.
    """
    if words[0] == "(":
        return _from_points(name, words)
    if not re.match(r"[^\W\d]", words[0]):
        return Term(name, "constant", tuple(map(number, words)))
    kind, order = JFUZZY.get(words[0].lower(), ("", ()))
    kind = kind or known(words[0], FLL_KINDS, "TERM")
    numbers = tuple(number(word) for word in words[1:] if word not in (",", "(", ")"))
    if order:
        if len(numbers) != len(order):
            raise InputError(f"{words[0]} has {len(numbers)} numbers; expected {len(order)}")
        return Term(name, kind, tuple(numbers[i] for i in order))
    return Term(name, kind, numbers)


def _from_points(name: str, words: tuple[str, ...]) -> Term:
    """Return the ramp, triangle or trapezium that a list of points is, or the list."""
    text = " ".join(words)
    found = re.findall(r"\( (\S+) , (\S+) \)", text)
    if " ".join(f"( {x} , {y} )" for x, y in found) != text:
        raise InputError(f"expected points such as (0, 1) (2, 0), found {text[:60]!r}")
    points = _bends([(number(a), number(b)) for a, b in found])
    x, y = tuple(x for x, _ in points), tuple(y for _, y in points)
    kinds: dict[tuple[float, ...], tuple[str, tuple[float, ...]]] = {
        (0, 1): ("ramp", x),
        (1, 0): ("ramp", x[::-1]),
        (0, 1, 0): ("triangular", x),
        (0, 1, 1, 0): ("trapezoidal", x),
        (1, 1): ("trapezoidal", (-inf, *x, inf)),
    }
    kind, parameters = kinds.get(y, ("points", tuple(n for point in points for n in point)))
    return Term(name, kind, parameters)


def _bends(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Leave out redundant points: beyond the first and the last, the height is constant."""
    heights = [None, *(y for _, y in points), None]
    kept = [
        point
        for point, before, after in zip(points, heights, heights[2:], strict=False)
        if not {before, after} <= {point[1], None}
    ]
    return kept if len(kept) > 1 else points[:2]


def number(word: str) -> float:
    """Return the number that a word is, or raise InputError."""
    try:
        return float(word)
    except ValueError:
        raise InputError(f"expected a number, found {word!r}") from None


def known(
    name: str,
    table: Mapping[str, str],
    subject: str,
    more: Mapping[str, str] = MappingProxyType({}),
) -> str:
    """Return our word for `name` by `table` or `more`; raise InputError for others."""
    for ours, theirs in (*table.items(), *more.items()):
        if theirs.upper() == name.upper():
            return ours
    raise InputError(
        f"the {subject} {name!r} has no counterpart; expected one of {', '.join(table.values())}"
    )
