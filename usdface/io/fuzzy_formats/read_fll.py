"""Fuzzy systems from FLL: one ``key: value`` a line, indented under its block."""

from collections.abc import Iterator
from dataclasses import replace
from math import inf, isfinite, isnan
from pathlib import Path
from typing import Any

from usdface.errors import InputError
from usdface.expression_system import ExpressionSystem
from usdface.findings import Finding, finding
from usdface.fuzzy.rule_parser import parse_rule
from usdface.fuzzy.rules import Rule
from usdface.fuzzy.variables import Term, Variable
from usdface.io.fuzzy_formats.draft import Draft, read_text, set_once
from usdface.io.fuzzy_formats.fll_keywords import DEFUZZIFIERS, FLL_KINDS, S_NORMS, SAMPLES, T_NORMS
from usdface.io.fuzzy_formats.format_limits import repeated_singletons
from usdface.io.fuzzy_formats.metadata_comments import finish

__all__ = ["read_fll"]

_BLOCKS = ("Engine", "InputVariable", "OutputVariable", "RuleBlock")


def read_fll(path: Path) -> tuple[ExpressionSystem, list[Finding]]:
    """Read a system from FLL.

    Raises
    ------
    InputError
        If it is no FLL, or uses an unsupported feature; the message names the line.
    """
    parser = _Parser(path.name)
    for line, key, value in _lines(path.name, read_text(path), parser.notes):
        try:
            parser.take(line, key, value)
        except InputError as error:
            raise InputError(f"{path.name}, line {line}: {error}") from error
    draft = parser.draft()
    system, findings = finish(path, draft)
    if "aggregation" in draft.settings:  # without one, every version adds up
        findings = [*findings, *repeated_singletons(path.name, system.fuzzy)]
    return system, findings


def _lines(name: str, text: str, notes: list[tuple[int, str]]) -> Iterator[tuple[int, str, str]]:
    for number, line in enumerate(text.splitlines(), start=1):
        content, _, comment = line.partition("#")
        if comment.strip().startswith("usdface:"):
            notes.append((number, comment.strip().removeprefix("usdface:")))
        if not content.strip():
            continue
        key, colon, value = content.partition(":")
        if not colon:
            raise InputError(
                f"{name}, line {number}: expected 'key: value', found {line.strip()!r}"
            )
        yield number, key.strip(), value.strip()


class _Parser:
    """The blocks of a file, as they come."""

    def __init__(self, name: str) -> None:
        self.notes: list[tuple[int, str]] = []
        self._name = name
        self._block = ""
        self._variables: dict[str, dict[str, Any]] = {}
        self._current: dict[str, Any] = {}
        self._settings: dict[str, Any] = {}
        self._rules: list[Rule] = []
        self._enabled = True
        self._findings: list[Finding] = []

    def take(self, line: int, key: str, value: str) -> None:
        if key in _BLOCKS:
            self._begin(key, value)
        elif key == "description" or (self._block == "Engine" and key == "enabled"):
            return
        elif self._block in ("InputVariable", "OutputVariable"):
            self._read_variable(line, key, value)
        elif self._block == "RuleBlock":
            self._read_rule_block(line, key, value)
        else:
            raise InputError(f"{key!r} is in no block; expected one of {', '.join(_BLOCKS)}")

    def _begin(self, block: str, name: str) -> None:
        self._block, self._enabled = block, True
        if block in ("InputVariable", "OutputVariable"):
            if name in self._variables:
                raise InputError(f"the variable {name!r} is there already; names must be unique")
            kind = "input" if block == "InputVariable" else "output"
            self._current = {"kind": kind, "terms": [], "range": None, "default": None}
            self._variables[name] = self._current

    def _read_variable(self, line: int, key: str, value: str) -> None:
        current = self._current
        if key == "range":
            current["range"] = tuple(_numbers(value, 2))
        elif key == "term":
            current["terms"].append(_read_term(value))
        elif key == "default":
            (current["default"],) = _numbers(value, 1)
        elif key == "aggregation":
            if value != "none":
                set_once(self._settings, "aggregation", _known(value, S_NORMS, "aggregation"))
        elif key == "defuzzifier":
            self._read_defuzzifier(value)
        elif (key, value) in (("enabled", "false"), ("lock-previous", "true")):
            self._report_dropped(line, f"{key}: {value}")
        elif key == "lock-range":
            if value == "true" and current["kind"] == "input":
                self._report_dropped(line, "lock-range: true of an input")
            current["locked"] = value == "true"
        elif key not in ("enabled", "lock-previous"):
            raise InputError(f"a variable has no {key!r}")

    def _read_defuzzifier(self, value: str) -> None:
        name, *rest = value.split() or [""]
        if name in ("WeightedAverage", "WeightedSum"):
            if rest and rest[0] not in ("TakagiSugeno", "Automatic"):
                raise InputError(f"the defuzzifier {value!r} has no counterpart; use TakagiSugeno")
            set_once(self._settings, "inference", "sugeno")
            average = name == "WeightedAverage"
            set_once(self._settings, "normalisation", "per_output" if average else "weighted_sum")
            return
        set_once(self._settings, "defuzzifier", _known(name, DEFUZZIFIERS, "defuzzifier"))
        set_once(self._settings, "inference", "mamdani")
        samples = _numbers(rest[0], 1)[0] if rest else SAMPLES
        if not samples == samples // 1 < inf:
            raise InputError(f"{name} has {samples:g} samples; expected a whole number")
        set_once(self._settings, "samples", int(samples))

    def _read_rule_block(self, line: int, key: str, value: str) -> None:
        if key == "rule":
            rule = _read_rule(value, self._enabled)
            self._rules.append(replace(rule, place=f"{self._name}, line {line}"))
        elif key == "enabled":
            self._enabled = value == "true"
        elif key == "conjunction" and value != "none":
            set_once(self._settings, "and_", _known(value, T_NORMS, "conjunction"))
        elif key == "disjunction" and value != "none":
            set_once(
                self._settings,
                "or_",
                _known(value, {k: v for k, v in S_NORMS.items() if k != "sum"}, key),
            )
        elif key == "implication" and value != "none":
            set_once(self._settings, "implication", _known(value, T_NORMS, "implication"))
        elif key == "activation":
            if value not in ("General", "none"):
                raise InputError(f"the activation {value!r} has no counterpart; use General")
        elif key not in ("conjunction", "disjunction", "implication"):
            raise InputError(f"a rule block has no {key!r}")

    def _report_dropped(self, line: int, subject: str) -> None:
        message = "{subject!r} has no counterpart and is left out"
        self._findings.append(
            finding("MEANING_DIFFERS", f"{self._name}, line {line}", message, subject)
        )

    def draft(self) -> Draft:
        variables = [self._made(name, parts) for name, parts in self._variables.items()]
        if not variables:
            raise InputError(f"{self._name} has no variables; it is no fuzzy system in FLL")
        settings: dict[str, Any] = {}
        if self._settings.get("inference") == "mamdani":
            settings["sampling"] = "middles"
        return Draft(
            tuple(variables),
            tuple(self._rules),
            settings | self._settings,
            tuple(self.notes),
            tuple(self._findings),
        )

    def _made(self, name: str, parts: dict[str, Any]) -> Variable:
        bounds = parts["range"] if parts["range"] and all(map(isfinite, parts["range"])) else None
        terms = tuple(parts["terms"])
        where = f"{self._name}: {name}"
        try:
            if parts["kind"] == "input":
                return Variable(name, "input", terms, bounds)
            bounds = None if bounds == (0.0, 1.0) else bounds
            low, high = bounds or (0.0, 1.0)
            free = any(t.kind == "linear" for t in terms) or any(
                not low <= t.parameters[0] <= high for t in terms if t.kind == "constant"
            )
            if free and not parts.get("locked"):
                message = "the outputs of {variable} are clipped to its range, {low:g} to {high:g}"
                self._findings.append(finding("MEANING_DIFFERS", where, message, name, low, high))
            default = parts["default"]
            if default is None or isnan(default):
                default = min(max(0.0, low), high)
                message = "{variable} has no default; where nothing fires it is {default:g}"
                self._findings.append(finding("MEANING_DIFFERS", where, message, name, default))
            return Variable(name, "output", terms=terms, range=bounds, default=default)
        except InputError as error:
            raise InputError(f"{self._name}: {error}") from error


def _read_term(value: str) -> Term:
    words = value.split()
    if len(words) < 2:
        raise InputError(f"expected a name, a kind and numbers, found {value!r}")
    name, kind, *parameters = words
    numbers = tuple(_numbers(" ".join(parameters), len(parameters)))
    if kind == "Rectangle" and len(numbers) == 2:
        kind, numbers = "Trapezoid", (numbers[0], numbers[0], numbers[1], numbers[1])
    ours = _known(kind, FLL_KINDS, "term")
    # One number more than the kind has is fuzzylite's height.
    if ours != "linear" and len(numbers) > 1 and numbers[-1] == 1:
        try:
            return Term(name, ours, numbers)
        except InputError:
            return Term(name, ours, numbers[:-1])
    return Term(name, ours, numbers)


def _read_rule(value: str, enabled: bool) -> Rule:
    words = value.split()
    if len(words) > 2 and words[-2] == "with":
        return parse_rule(" ".join(words[:-2]), _numbers(words[-1], 1)[0], enabled)
    return parse_rule(value, 1.0, enabled)


def _numbers(text: str, count: int) -> list[float]:
    words = text.split()
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        numbers = []
    if len(numbers) != count:
        raise InputError(f"expected {count} number{'s' * (count != 1)}, found {text!r}")
    return numbers


def _known(name: str, table: dict[str, str], subject: str) -> str:
    for ours, theirs in table.items():
        if theirs == name:
            return ours
    raise InputError(
        f"the {subject} {name!r} has no counterpart; expected one of {', '.join(table.values())}"
    )
