"""FCL, the Fuzzy Control Language of IEC 61131-7:2000, with the words that programs add to it.

The standard's terms are lists of points and singletons. Smooth terms, norms beyond its three and
linear conclusions are written as fuzzylite reads them, and those of jFuzzyLogic are read too.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from math import inf, isfinite
from pathlib import Path
from typing import Any

from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.fuzzy.rules import Rule, parse_rule
from usdface.fuzzy.system import FuzzySystem, Term, Variable
from usdface.io.fuzzy_formats.fll import FLL_KINDS
from usdface.io.fuzzy_formats.notes import (
    FACE_SETTINGS,
    Draft,
    check_names,
    differs,
    finish,
    guessed_input,
    notes_of,
    read_text,
)
from usdface.io.fuzzy_formats.rule_text import as_ramp, conclusions, condition_text, output_terms

__all__ = ["fcl_text", "read_fcl"]

_AND = {
    "min": "MIN",
    "prod": "PROD",
    "lukasiewicz": "BDIF",
    "hamacher": "HPROD",
    "einstein": "EPROD",
    "drastic": "DPROD",
    "nilpotent": "NMIN",
}
_OR = {
    "max": "MAX",
    "probor": "ASUM",
    "lukasiewicz": "BSUM",
    "hamacher": "HSUM",
    "einstein": "ESUM",
    "drastic": "DSUM",
    "nilpotent": "NMAX",
}
_ACCU = _OR | {"sum": "SUM"}
_METHODS = {
    "centroid": "COG",
    "bisector": "COA",
    "smallest_of_max": "LM",
    "largest_of_max": "RM",
    "mean_of_max": "MM",
}
_DUAL_AND = dict(zip(_OR, _AND, strict=True))
_DUAL_OR = dict(zip(_AND, _OR, strict=True))
# jFuzzyLogic's words, and where their parameters stand among ours.
_JFUZZY: dict[str, tuple[str, tuple[int, ...]]] = {
    "trian": ("triangular", (0, 1, 2)),
    "trape": ("trapezoidal", (0, 1, 2, 3)),
    "gauss": ("gaussian", (0, 1)),
    "gbell": ("bell", (2, 0, 1)),
    "sigm": ("sigmoid", (1, 0)),
}
_SMOOTH = ("gaussian", "gaussian_pair", "sigmoid", "bell", "s_shape", "z_shape", "pi_shape")
_TOKEN = re.compile(
    r"""(?P<space>\s+|//[^\n]*|\(\*.*?\*\))
    |(?P<word>[^\W\d]\w*)
    |(?P<number>[-+]?(?:\d+\.(?!\.)\d*|\.\d+|\d+)(?:[eE][-+]?\d+)?|[-+]inf\b)
    |(?P<mark>:=|\.\.|[:;(),])""",
    re.VERBOSE | re.DOTALL,
)


def fcl_text(system: FuzzySystem, name: str) -> tuple[str, list[Finding]]:
    """Return a system as FCL.

    Raises
    ------
    OutputError
        If a name cannot be written.
    """
    check_names(system, ".fcl")
    mamdani = system.inference == "mamdani"
    kinds = {t.kind for v in system.variables for t in v.terms}
    beyond = [
        (not kinds.isdisjoint({*_SMOOTH, "linear"}), "terms that are no lists of points"),
        (any("(" in condition_text(r.condition) for r in system.rules), "parentheses"),
        (system.normalisation == "weighted_sum" and not mamdani, "the weighted sum"),
    ]
    sampled = ("samples", "sampling") if mamdani else ()
    fields = (*FACE_SETTINGS, "normalisation", *sampled)
    lines = [f"// {note}" for note in notes_of(system, fields)]
    lines += [f"FUNCTION_BLOCK {name}", ""]
    for kind, variables in (("VAR_INPUT", system.inputs), ("VAR_OUTPUT", system.outputs)):
        lines += [kind, *(f"    {v.name} : REAL;" for v in variables), "END_VAR", ""]
    for v in system.inputs:
        ranged = [f"    RANGE := ({v.range[0]!r} .. {v.range[1]!r});"] if v.range else []
        lines += [f"FUZZIFY {v.name}", *ranged, *map(_term, v.terms), "END_FUZZIFY", ""]
    for v in system.outputs:
        lines += [f"DEFUZZIFY {v.name}", f"    RANGE := ({v.span[0]!r} .. {v.span[1]!r});"]
        lines += map(_term, output_terms(system, v))
        lines.append(f"    METHOD : {_METHODS[system.defuzzifier] if mamdani else 'COGS'};")
        lines += [f"    ACCU : {_ACCU[system.aggregation]};"] if mamdani else []
        lines += [f"    DEFAULT := {v.default!r};", "END_DEFUZZIFY", ""]
    lines += ["RULEBLOCK rules", f"    AND : {_AND[system.and_]};", f"    OR : {_OR[system.or_]};"]
    lines += [f"    ACT : {_AND[system.implication]};"] if mamdani else []
    lines += [f"    RULE {i + 1} : {_rule(rule)};" for i, rule in enumerate(system.rules)]
    lines += ["END_RULEBLOCK", "", "END_FUNCTION_BLOCK"]
    return "\n".join(lines) + "\n", differs(system, ".fcl", beyond)


def _term(term: Term) -> str:
    p = as_ramp(term).parameters
    kind = as_ramp(term).kind
    if kind == "constant":
        said = repr(p[0])
    elif kind in (*_SMOOTH, "linear") or not all(map(isfinite, p)):
        said = f"{FLL_KINDS[kind]} {' '.join(map(repr, p))}"
    else:
        heights = {"ramp": (0, 1) if p[0] < p[1] else (1, 0), "triangular": (0, 1, 0)}
        points = zip(sorted(p), heights.get(kind, (0, 1, 1, 0)), strict=True)
        said = " ".join(f"({x!r}, {y})" for x, y in points)
    return f"    TERM {term.name} := {said};"


def _rule(rule: Rule) -> str:
    ends = ", ".join(f"{output} IS {term}" for output, term in conclusions(rule))
    # A rule that is switched off weighs nothing for others; its weight is in the notes.
    weight = rule.weight if rule.enabled else 0.0
    weighted = "" if weight == 1 else f" WITH {weight!r}"
    return f"IF {condition_text(rule.condition)} THEN {ends}{weighted}"


def read_fcl(path: Path) -> tuple[FuzzySystem, list[Finding]]:
    """Read a system from FCL: the file's one function block.

    Raises
    ------
    InputError
        If it is no FCL, or has what our systems have not; the message names the line.
    """
    text = read_text(path)
    notes = tuple(
        (number, line.strip()[2:].strip().removeprefix("usdface:"))
        for number, line in enumerate(text.splitlines(), start=1)
        if re.match(r"\s*//\s*usdface:", line)
    )
    parser = _Parser(path.name)
    for statement in _statements(path.name, text):
        try:
            parser.take(statement)
        except InputError as error:
            raise InputError(f"{path.name}, line {statement.line}: {error}") from error
    return finish(path, parser.draft(notes))


@dataclass(frozen=True, slots=True)
class _Statement:
    line: int
    words: tuple[str, ...]

    @property
    def first(self) -> str:
        return self.words[0].upper()

    def __str__(self) -> str:
        return " ".join(self.words)


# These stand alone or with a name, without a semicolon.
_ALONE = {"VAR_INPUT", "VAR_OUTPUT", "VAR"}
_NAMED = {"FUNCTION_BLOCK", "FUZZIFY", "DEFUZZIFY", "RULEBLOCK"}


def _statements(name: str, text: str) -> Iterator[_Statement]:
    """Cut the text into statements: up to a semicolon, or a keyword that needs none."""
    words: list[str] = []
    begin = at = 0
    line = 1
    while at < len(text):
        match = _TOKEN.match(text, at)
        if match is None:
            raise InputError(f"{name}, line {line}: {text[at : at + 20].split()[0]!r} is no FCL")
        at = match.end()
        if match.lastgroup != "space":
            begin = begin if words else line
            if match.group() == ";":
                if words:
                    yield _Statement(begin, tuple(words))
                words = []
            else:
                words.append(match.group())
                first = words[0].upper()
                alone = first in _ALONE or first.startswith("END_")
                if alone or (first in _NAMED and len(words) == 2):
                    yield _Statement(begin, tuple(words))
                    words = []
        line += match.group().count("\n")
    if words:
        raise InputError(f"{name}, line {begin}: {words[0]!r} has no end; the file is cut off")


@dataclass(slots=True)
class _Parts:
    """What has been read of one variable."""

    kind: str
    terms: list[Term] = field(default_factory=list)
    range: tuple[float, float] | None = None
    default: float | None = None


class _Parser:
    """The blocks of a file, as they come."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._block = ""
        self._current = ""
        self._blocks = 0
        self._variables: dict[str, _Parts] = {}
        self._rules: list[Rule] = []
        self._settings: dict[str, Any] = {}

    def take(self, statement: _Statement) -> None:
        first, words = statement.first, statement.words
        if first.startswith("END_"):
            self._block = ""
        elif first in _ALONE or first in _NAMED:
            self._begin(first, words)
        elif self._block == "VAR":
            return
        elif self._block in ("VAR_INPUT", "VAR_OUTPUT"):
            self._declare(statement)
        elif self._block in ("FUZZIFY", "DEFUZZIFY"):
            self._describe(statement)
        elif self._block == "RULEBLOCK":
            self._rule_block(statement)
        else:
            raise InputError(f"{str(statement)[:60]!r} stands in no block")

    def _begin(self, block: str, words: tuple[str, ...]) -> None:
        if block == "FUNCTION_BLOCK":
            self._blocks += 1
            if self._blocks > 1:
                raise InputError("a second FUNCTION_BLOCK; put each system into a file of its own")
            return
        self._block = block
        if block in ("FUZZIFY", "DEFUZZIFY"):
            kind = "input" if block == "FUZZIFY" else "output"
            if words[1] not in self._variables or self._variables[words[1]].kind != kind:
                raise InputError(f"{block} {words[1]}: there is no {kind} of that name")
            self._current = words[1]

    def _declare(self, statement: _Statement) -> None:
        words = statement.words
        kind = "input" if self._block == "VAR_INPUT" else "output"
        if len(words) < 3 or words[1] != ":" or words[2].upper() not in ("REAL", "LREAL"):
            raise InputError(f"expected 'name : REAL;', found {str(statement)[:60]!r}")
        if words[0] in self._variables:
            raise InputError(f"the variable {words[0]!r} is there already; names must be unique")
        self._variables[words[0]] = _Parts(kind)

    def _describe(self, statement: _Statement) -> None:
        parts, words = self._variables[self._current], statement.words
        if statement.first == "TERM" and len(words) > 3 and words[2] == ":=":
            parts.terms.append(_read_term(words[1], words[3:]))
        elif statement.first == "RANGE" and len(words) == 7 and words[4] == "..":
            parts.range = (_number(words[3]), _number(words[5]))
        elif statement.first == "DEFAULT" and len(words) == 3:
            parts.default = None if words[2].upper() in ("NC", "NAN") else _number(words[2])
        elif statement.first == "METHOD" and len(words) == 3:
            self._method(words[2].upper())
        elif statement.first == "ACCU" and len(words) == 3:
            self._set("aggregation", _known(words[2], _ACCU, "ACCU"))
        else:
            raise InputError(f"{str(statement)[:60]!r} has no counterpart")

    def _method(self, method: str) -> None:
        if method == "COGS":
            self._set("inference", "sugeno")
        else:
            self._set("inference", "mamdani")
            self._set("defuzzifier", _known(method, _METHODS, "METHOD"))

    def _rule_block(self, statement: _Statement) -> None:
        words = statement.words
        if statement.first == "RULE" and ":" in words:
            rule = _read_rule(words[words.index(":") + 1 :])
            self._rules.append(replace(rule, place=f"{self._name}, line {statement.line}"))
            return
        tables = {
            "AND": ("and_", _AND),
            "OR": ("or_", _OR),
            "ACT": ("implication", _AND),
            "ACCU": ("aggregation", _ACCU),
        }
        if statement.first not in tables or len(words) != 3:
            raise InputError(f"{str(statement)[:60]!r} has no counterpart")
        setting, table = tables[statement.first]
        self._set(setting, _known(words[2], table, statement.first))

    def _set(self, name: str, value: object) -> None:
        if self._settings.setdefault(name, value) != value:
            raise InputError(
                f"{name.strip('_')} is {value} here and {self._settings[name]} before; a system "
                "has one; split the file into one for each"
            )

    def draft(self, notes: tuple[tuple[int, str], ...]) -> Draft:
        if not self._variables:
            raise InputError(f"{self._name} has no variables; it is no fuzzy system in FCL")
        if self._block:
            raise InputError(f"{self._name} ends inside {self._block}; the file is cut off")
        settings: dict[str, Any] = {"neutral_rule": False, "normalisation": "per_output"}
        settings |= self._settings
        # The standard lets either stand for both.
        if "and_" in settings:
            settings.setdefault("or_", _DUAL_OR[settings["and_"]])
        elif "or_" in settings:
            settings["and_"] = _DUAL_AND[settings["or_"]]
        findings: list[Finding] = []
        variables = [self._made(name, p, findings) for name, p in self._variables.items()]
        return Draft(tuple(variables), tuple(self._rules), settings, notes, tuple(findings))

    def _made(self, name: str, parts: _Parts, findings: list[Finding]) -> Variable:
        terms = tuple(parts.terms)
        try:
            if parts.kind == "input":
                guess = guessed_input(name)
                return Variable(
                    name, "input", guess.role, guess.axis, terms=terms, range=parts.range
                )
            span = parts.range or _span(terms)
            default = parts.default
            if default is None:
                default = min(max(0.0, span[0]), span[1])
                where = f"{self._name}: {name}"
                message = f"{name} has no default; where nothing fires it is {default:g}"
                findings.append(finding("MEANING_DIFFERS", where, message))
            bounds = None if span == (0.0, 1.0) else span
            return Variable(name, "output", terms=terms, range=bounds, default=default)
        except InputError as error:
            raise InputError(f"{self._name}: {error}") from error


def _span(terms: tuple[Term, ...]) -> tuple[float, float]:
    """Return where an output without a range lies: where its terms do."""
    marks = [p for t in terms if t.kind != "linear" for p in t.parameters if isfinite(p)]
    low, high = min(marks, default=0.0), max(marks, default=1.0)
    return (low, high) if low < high else (min(low, 0.0), max(high, 1.0))


def _read_term(name: str, words: tuple[str, ...]) -> Term:
    if words[0] == "(":
        return _from_points(name, words)
    if not re.match(r"[^\W\d]", words[0]):
        return Term(name, "constant", tuple(map(_number, words)))
    numbers = tuple(_number(word) for word in words[1:] if word not in (",", "(", ")"))
    if words[0].lower() in _JFUZZY:
        kind, order = _JFUZZY[words[0].lower()]
        if len(numbers) != len(order):
            raise InputError(f"{words[0]} has {len(numbers)} numbers; expected {len(order)}")
        return Term(name, kind, tuple(numbers[i] for i in order))
    return Term(name, _known(words[0], FLL_KINDS, "TERM"), numbers)


def _from_points(name: str, words: tuple[str, ...]) -> Term:
    """Return the ramp, triangle or trapezium that a list of points is."""
    text = " ".join(words)
    found = re.findall(r"\( (\S+) , (\S+) \)", text)
    if " ".join(f"( {x} , {y} )" for x, y in found) != text:
        raise InputError(f"expected points such as (0, 1) (2, 0), found {text[:60]!r}")
    x = tuple(_number(a) for a, _ in found)
    y = tuple(_number(b) for _, b in found)
    kinds: dict[tuple[float, ...], tuple[str, tuple[float, ...]]] = {
        (0, 1): ("ramp", x),
        (1, 0): ("ramp", x[::-1]),
        (0, 1, 0): ("triangular", x),
        (0, 1, 1, 0): ("trapezoidal", x),
        (0, 1, 1): ("trapezoidal", (*x, inf)),
        (1, 1, 0): ("trapezoidal", (-inf, *x)),
        (1, 1): ("trapezoidal", (-inf, *x, inf)),
    }
    if y not in kinds:
        raise InputError(
            f"the term {name!r} has the heights {', '.join(f'{v:g}' for v in y)}; "
            "expected a ramp, a triangle or a trapezium between 0 and 1"
        )
    kind, parameters = kinds[y]
    return Term(name, kind, parameters)


def _read_rule(words: tuple[str, ...]) -> Rule:
    weight = 1.0
    if len(words) > 2 and words[-2].upper() == "WITH":
        weight, words = _number(words[-1]), words[:-2]
    then = next((i for i, word in enumerate(words) if word.upper() == "THEN"), len(words))
    said = ("AND" if word == "," else word for word in words[then:])
    return parse_rule(" ".join((*words[:then], *said)), weight)


def _number(word: str) -> float:
    try:
        return float(word)
    except ValueError:
        raise InputError(f"expected a number, found {word!r}") from None


def _known(name: str, table: dict[str, str], what: str) -> str:
    for ours, theirs in table.items():
        if theirs.upper() == name.upper():
            return ours
    raise InputError(
        f"the {what} {name!r} has no counterpart; expected one of {', '.join(table.values())}"
    )
