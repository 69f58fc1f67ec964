"""What usdface knows of a system and the formats cannot say: JSON in lines of comment.

::

    usdface: {"system": {"normalisation": "all_rules", "neutral_rule": true}}
    usdface: {"input": "lip_lower_y", "role": "lip_lower", "axis": "y", "measure": "signed"}
    usdface: {"output": "joy", "default": 0.0}
    usdface: {"rule": 3, "enabled": false, "weight": 0.5}

Other programs skip them. Where they are missing, the name of an input says which marker it reads
(``lip_lower_y``: the role lip_lower, the axis y) and settings are those of the other program.
"""

import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, TypeVar, cast

from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.fuzzy.membership import places
from usdface.fuzzy.rules import Rule
from usdface.fuzzy.system import Axis, FaceUnit, FuzzySystem, Variable
from usdface.io.fuzzy_formats.rule_text import numbers_back

__all__ = [
    "FACE_SETTINGS",
    "Draft",
    "finish",
    "guessed_input",
    "notes_of",
    "read_text",
]

# What no format has a place for.
FACE_SETTINGS = (
    "space",
    "face_unit",
    "mode",
    "gain",
    "neutral_rule",
    "response",
    "smoothing",
    "blend_time",
    "ease",
)
_SETTINGS: dict[str, type | tuple[type, ...]] = {
    "space": str,
    "face_unit": str,
    "mode": str,
    "gain": (int, float),
    "neutral_rule": bool,
    "response": list,
    "smoothing": (int, float),
    "blend_time": (int, float),
    "ease": (int, float),
    "normalisation": str,
    "and_": str,
    "or_": str,
    "implication": str,
    "aggregation": str,
    "defuzzifier": str,
    "samples": int,
    "sampling": str,
}
_VARIABLE: dict[str, type | tuple[type, ...]] = {
    "role": str,
    "axis": str,
    "measure": str,
    "range": type(None),
    "default": (int, float),
}
_RULE: dict[str, type | tuple[type, ...]] = {"enabled": bool, "weight": (int, float)}
# Larger ones were not written by people or for them.
_MOST_BYTES = 4 << 20

_Made = TypeVar("_Made")


@dataclass(frozen=True, slots=True)
class Draft:
    """What the lines of a file say, before the notes."""

    variables: tuple[Variable, ...]
    rules: tuple[Rule, ...]
    settings: dict[str, Any]
    notes: tuple[tuple[int, str], ...] = ()
    findings: tuple[Finding, ...] = field(default=())


def read_text(path: Path) -> str:
    """Read a file that people write.

    Raises
    ------
    InputError
        If it cannot be read, is empty, too large or not text.
    """
    try:
        if path.stat().st_size > _MOST_BYTES:
            raise InputError(f"{path} has more than {_MOST_BYTES >> 20} MB: no fuzzy system")
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from error
    if b"\0" in data or not data.strip():
        raise InputError(f"{path} is {'empty' if not data.strip() else 'not text'}")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def guessed_input(name: str) -> Variable:
    """Return an input whose name says which marker and axis it reads."""
    role, _, axis = name.rpartition("_")
    if role and axis in ("x", "y", "z"):
        return Variable(name, "input", role, cast("Axis", axis))
    return Variable(name, "input", name)


def notes_of(
    system: FuzzySystem, settings: Iterable[str], ranges: bool = False, defaults: bool = False
) -> list[str]:
    """Return the notes of a system, without comment marks.

    Parameters
    ----------
    system : FuzzySystem
    settings : iterable of str
        Fields of the system that the format cannot say.
    ranges, defaults : bool
        Whether to say which inputs have no range, and what outputs answer where nothing fires.
    """
    notes: list[dict[str, Any]] = [{"system": {name: getattr(system, name) for name in settings}}]
    for v in system.inputs:
        note = {"input": v.name, "role": v.role, "axis": v.axis, "measure": v.measure}
        notes.append(note | ({"range": None} if ranges and v.range is None else {}))
    if defaults:
        notes += [{"output": v.name, "default": v.default} for v in system.outputs]
    notes += [
        {"rule": i + 1, "enabled": False, "weight": rule.weight}
        for i, rule in enumerate(system.rules)
        if not rule.enabled
    ]
    return [f"usdface: {json.dumps(note)}" for note in notes]


def finish(path: Path, draft: Draft) -> tuple[FuzzySystem, list[Finding]]:
    """Make a system of what a file says and what its notes say.

    Raises
    ------
    InputError
        If they make no system; the message names the file.
    """
    variables = {v.name: v for v in draft.variables}
    rules = list(draft.rules)
    settings = dict(draft.settings)
    told = set()
    for line, text in draft.notes:
        where = f"{path.name}, line {line}"
        note = _note(where, text)
        if "system" in note:
            settings |= _checked(where, note["system"], _SETTINGS)
        elif "rule" in note:
            number = note.pop("rule")
            if type(number) is not int or not 1 <= number <= len(rules):
                raise InputError(f"{where}: there is no rule {number}; correct the note")
            values = _checked(where, note, _RULE)
            rules[number - 1] = _named(where, partial(replace, rules[number - 1], **values))
        else:
            name = note.pop("input", None) or note.pop("output", None)
            if name not in variables:
                raise InputError(f"{where}: there is no variable {name!r}; correct the note")
            told.add(name)
            values = _checked(where, note, _VARIABLE)
            variables[name] = _named(where, partial(replace, variables[name], **values))
    findings = list(draft.findings)
    if "face_unit" not in settings:
        settings["face_unit"], reach = _assumed_unit(variables.values())
        unit = "millimetres" if settings["face_unit"] == "none" else "face units"
        message = f"the file names no unit; its terms reach to {reach:g}, so inputs are in {unit}"
        findings.append(finding("UNITS_ASSUMED", path.name, message))
    kept, said = numbers_back(tuple(variables.values()), rules)
    system = _named(path.name, lambda: FuzzySystem(kept, said, **settings))
    for v in system.inputs:
        if v.name not in told:
            message = f"the input {v.name} is taken to read the marker {v.role} along {v.axis}"
            findings.append(finding("ROLE_ASSUMED", f"{path.name}: {v.name}", message))
    return system, findings


def _assumed_unit(variables: Iterable[Variable]) -> tuple[FaceUnit, float]:
    """Return what inputs are likely divided by, and how far their terms reach."""
    terms = (term for v in variables if v.kind == "input" for term in v.terms)
    reach = max((abs(p) for t in terms for p in places(t.kind, t.parameters)), default=0.0)
    # A face unit is about six centimetres: no marker moves so far.
    return ("none" if reach > 1 else "marker_spread"), reach


def _note(where: str, text: str) -> dict[str, Any]:
    try:
        note = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(
            f"{where}: the note of usdface is no JSON; correct or remove it"
        ) from error
    if not isinstance(note, dict) or not note.keys() & {"system", "input", "output", "rule"}:
        raise InputError(f"{where}: the note of usdface is about nothing; correct or remove it")
    if any(not isinstance(note.get(key, ""), str) for key in ("input", "output")):
        raise InputError(f"{where}: the note of usdface names no variable; correct or remove it")
    return note


def _checked(where: str, values: Any, kinds: dict[str, Any]) -> dict[str, Any]:
    if not isinstance(values, dict):
        raise InputError(f"{where}: expected an object in the note, found {values!r}")
    for name, value in values.items():
        kind = kinds.get(name)
        # A bool is an int to Python, but no number to a reader.
        if kind is None or not isinstance(value, kind) or (kind is not bool and value is True):
            raise InputError(f"{where}: the note cannot set {name} to {value!r}; correct it")
    return dict(values)


def _named(where: str, make: Callable[[], _Made]) -> _Made:
    try:
        return make()
    except InputError as error:
        # A rule names its place by itself.
        prefix = "" if str(error).startswith(f"{where}, line ") else f"{where}: "
        raise InputError(f"{prefix}{error}") from error
