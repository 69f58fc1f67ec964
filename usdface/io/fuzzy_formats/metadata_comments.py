"""Metadata that the formats lack, as JSON in comment lines.

::

    usdface: {"system": {"normalisation": "all_rules", "neutral_rule": true}}
    usdface: {"input": "lip_lower_y", "role": "lip_lower", "axis": "y", "measure": "signed"}
    usdface: {"output": "joy", "default": 0.0}
    usdface: {"rule": 3, "enabled": false, "weight": 0.5}

Other programs skip them. Where they are missing, the name of an input is the marker that it reads
(``lip_lower_y``: the role lip_lower, the axis y) and settings are those of the other program.

Keys are the fields of `ExpressionSystem`, `FuzzySystem`, `MarkerFeature`, `Variable` and `Rule`,
but for "neutral_rule", which is `FuzzySystem.else_rule`.
"""

import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, TypeVar, cast

from usdface.errors import InputError
from usdface.expression_system import Axis, ExpressionSystem, FaceUnit, MarkerFeature
from usdface.findings import Finding, finding
from usdface.fuzzy.membership import places
from usdface.fuzzy.rules import Rule
from usdface.fuzzy.system import FuzzySystem
from usdface.fuzzy.variables import Variable
from usdface.io.fuzzy_formats.rule_text import numbers_back

__all__ = [
    "FACE_SETTINGS",
    "Draft",
    "finish",
    "guessed_feature",
    "notes_of",
    "read_text",
    "set_once",
]

# Settings that no format has a place for.
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
    "evidence",
    "likeness",
)
_EXPRESSION: dict[str, type | tuple[type, ...]] = {
    "space": str,
    "face_unit": str,
    "mode": str,
    "gain": (int, float),
    "response": list,
    "smoothing": (int, float),
    "blend_time": (int, float),
    "ease": (int, float),
    "evidence": (int, float),
    "likeness": (int, float),
}
_FUZZY: dict[str, type | tuple[type, ...]] = {
    "neutral_rule": bool,
    "normalisation": str,
    "and_": str,
    "or_": str,
    "implication": str,
    "aggregation": str,
    "defuzzifier": str,
    "samples": int,
    "sampling": str,
}
_FEATURE: dict[str, type | tuple[type, ...]] = {"role": str, "axis": str, "measure": str}
_VARIABLE: dict[str, type | tuple[type, ...]] = {
    "range": type(None),
    "default": (int, float),
}
_RULE: dict[str, type | tuple[type, ...]] = {"enabled": bool, "weight": (int, float)}
# Larger ones were not written by people or for them.
_MOST_BYTES = 4 << 20

_Made = TypeVar("_Made")


@dataclass(frozen=True, slots=True)
class Draft:
    """The fuzzy system in the lines of a file, before the notes.

    `settings` are fields of `FuzzySystem`.
    """

    variables: tuple[Variable, ...]
    rules: tuple[Rule, ...]
    settings: dict[str, Any]
    notes: tuple[tuple[int, str], ...] = ()
    findings: tuple[Finding, ...] = field(default=())


def set_once(settings: dict[str, Any], name: str, value: object) -> None:
    """Set a field of a `Draft`'s settings, which all blocks of a file must give alike.

    Raises
    ------
    InputError
        If it has another value already.
    """
    if settings.setdefault(name, value) != value:
        raise InputError(
            f"{name.strip('_')} is {value} here and {settings[name]} before; a system "
            "has one; split the file into one for each"
        )


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
        raise InputError(
            f"cannot read {path}: {error.strerror or error}", "FILE_UNREADABLE"
        ) from error
    if b"\0" in data or not data.strip():
        raise InputError(f"{path} is {'empty' if not data.strip() else 'not text'}")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def guessed_feature(name: str) -> MarkerFeature:
    """Return the marker feature that the name of an input suggests."""
    role, _, axis = name.rpartition("_")
    if role and axis in ("x", "y", "z"):
        return MarkerFeature(role, cast("Axis", axis))
    return MarkerFeature(name)


def notes_of(
    system: ExpressionSystem, settings: Iterable[str], ranges: bool = False, defaults: bool = False
) -> list[str]:
    """Return the notes of a system, without comment marks.

    Parameters
    ----------
    system : ExpressionSystem
    settings : iterable of str
        Keys of the note "system": the settings that the format cannot say.
    ranges, defaults : bool
        Whether to say which inputs have no range, and the defaults of outputs where nothing fires.
    """
    fuzzy = system.fuzzy
    notes: list[dict[str, Any]] = [{"system": {name: _setting(system, name) for name in settings}}]
    for v, feature in zip(fuzzy.inputs, system.features, strict=True):
        note = {"input": v.name, **{name: getattr(feature, name) for name in _FEATURE}}
        notes.append(note | ({"range": None} if ranges and v.range is None else {}))
    if defaults:
        notes += [{"output": v.name, "default": v.default} for v in fuzzy.outputs]
    notes += [
        {"rule": i + 1, "enabled": False, "weight": rule.weight}
        for i, rule in enumerate(fuzzy.rules)
        if not rule.enabled
    ]
    return [f"usdface: {json.dumps(note)}" for note in notes]


def _setting(system: ExpressionSystem, name: str) -> Any:
    return getattr(system.fuzzy, _field(name)) if name in _FUZZY else getattr(system, name)


def _field(name: str) -> str:
    """Return the field of `FuzzySystem` that a key of a note sets."""
    return "else_rule" if name == "neutral_rule" else name


def finish(path: Path, draft: Draft) -> tuple[ExpressionSystem, list[Finding]]:
    """Make a system of the content of a file and its metadata comments.

    Raises
    ------
    InputError
        If they make no system; the message names the file.
    """
    variables = {v.name: v for v in draft.variables}
    features = {v.name: guessed_feature(v.name) for v in draft.variables if v.kind == "input"}
    rules = list(draft.rules)
    settings, expression = dict(draft.settings), dict[str, Any]()
    noted = set()
    for line, text in draft.notes:
        where = f"{path.name}, line {line}"
        note = _note(where, text)
        if "system" in note:
            values = _checked(where, note["system"], _EXPRESSION | _FUZZY)
            settings |= {_field(name): values.pop(name) for name in _FUZZY if name in values}
            expression |= values
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
            noted.add(name)
            known = _VARIABLE | (_FEATURE if name in features else {})
            values = _checked(where, note, known)
            read = {key: values.pop(key) for key in _FEATURE if key in values}
            variables[name] = _named(where, partial(replace, variables[name], **values))
            if read:
                features[name] = _named(where, partial(replace, features[name], **read))
    findings = list(draft.findings)
    if "face_unit" not in expression:
        expression["face_unit"], reach = _assumed_unit(variables.values())
        unit = "millimetres" if expression["face_unit"] == "none" else "face units"
        message = "the file names no unit; its terms reach to {reach:g}, so inputs are in {unit}"
        findings.append(finding("UNITS_ASSUMED", path.name, message, reach, unit))
    kept, written = numbers_back(tuple(variables.values()), rules)
    fuzzy = _named(path.name, lambda: FuzzySystem(kept, written, **settings))
    read_by = tuple(features[v.name] for v in fuzzy.inputs)
    system = _named(path.name, lambda: ExpressionSystem(fuzzy, read_by, **expression))
    for name, feature in features.items():
        if name not in noted:
            message = "the input {variable} is taken to read the marker {marker} along {axis}"
            findings.append(
                finding(
                    "ROLE_ASSUMED",
                    f"{path.name}: {name}",
                    message,
                    name,
                    feature.role,
                    feature.axis,
                )
            )
    return system, findings


def _assumed_unit(variables: Iterable[Variable]) -> tuple[FaceUnit, float]:
    """Return the likely unit of the inputs, and the range of their terms."""
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
