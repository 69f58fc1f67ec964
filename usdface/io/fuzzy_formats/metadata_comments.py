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
from dataclasses import dataclass, field, fields, replace
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
from usdface.io.fuzzy_formats.draft import Draft
from usdface.io.fuzzy_formats.rule_text import numbers_back

__all__ = ["FACE_SETTINGS", "finish", "guessed_feature", "notes_of"]

# Settings that no format has a place for, in their order in files.
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
# The JSON types of a setting, by the type of its default.
_JSON: dict[type, type | tuple[type, ...]] = {str: str, float: (int, float), tuple: list}
_EXPRESSION = {
    setting.name: _JSON[type(setting.default)]
    for setting in fields(ExpressionSystem)
    if setting.name in FACE_SETTINGS
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
_Made = TypeVar("_Made")


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


@dataclass(slots=True)
class _Parts:
    """The parts of a system while notes are applied to them, by name."""

    variables: dict[str, Variable]
    features: dict[str, MarkerFeature]
    rules: list[Rule]
    settings: dict[str, Any]
    expression: dict[str, Any] = field(default_factory=dict)
    noted: set[str] = field(default_factory=set)

    def apply(self, where: str, note: dict[str, Any]) -> None:
        """Apply a note to the system, a rule or a variable."""
        if "system" in note:
            values = _checked(where, note["system"], _EXPRESSION | _FUZZY)
            self.settings |= {_field(name): values.pop(name) for name in _FUZZY if name in values}
            self.expression |= values
        elif "rule" in note:
            self._apply_to_rule(where, note)
        else:
            self._apply_to_variable(where, note)

    def _apply_to_rule(self, where: str, note: dict[str, Any]) -> None:
        number = note.pop("rule")
        if type(number) is not int or not 1 <= number <= len(self.rules):
            raise InputError(f"{where}: there is no rule {number}; correct the note")
        values = _checked(where, note, _RULE)
        changed = partial(replace, self.rules[number - 1], **values)
        self.rules[number - 1] = _named(where, changed)

    def _apply_to_variable(self, where: str, note: dict[str, Any]) -> None:
        name = note.pop("input", None) or note.pop("output", None)
        if name not in self.variables:
            raise InputError(f"{where}: there is no variable {name!r}; correct the note")
        self.noted.add(name)
        known = _VARIABLE | (_FEATURE if name in self.features else {})
        values = _checked(where, note, known)
        read = {key: values.pop(key) for key in _FEATURE if key in values}
        self.variables[name] = _named(where, partial(replace, self.variables[name], **values))
        if read:
            self.features[name] = _named(where, partial(replace, self.features[name], **read))


def finish(path: Path, draft: Draft) -> tuple[ExpressionSystem, list[Finding]]:
    """Make a system of the content of a file and its metadata comments.

    Raises
    ------
    InputError
        If they make no system; the message names the file.
    """
    parts = _Parts(
        {v.name: v for v in draft.variables},
        {v.name: guessed_feature(v.name) for v in draft.variables if v.kind == "input"},
        list(draft.rules),
        dict(draft.settings),
    )
    for line, text in draft.notes:
        where = f"{path.name}, line {line}"
        parts.apply(where, _note(where, text))
    findings = list(draft.findings)
    if "face_unit" not in parts.expression:
        parts.expression["face_unit"], reach = _assumed_unit(parts.variables.values())
        unit = "millimetres" if parts.expression["face_unit"] == "none" else "face units"
        message = "the file names no unit; its terms reach to {reach:g}, so inputs are in {unit}"
        findings.append(finding("UNITS_ASSUMED", path.name, message, reach, unit))
    kept, written = numbers_back(tuple(parts.variables.values()), parts.rules)
    fuzzy = _named(path.name, lambda: FuzzySystem(kept, written, **parts.settings))
    read_by = tuple(parts.features[v.name] for v in fuzzy.inputs)
    system = _named(path.name, lambda: ExpressionSystem(fuzzy, read_by, **parts.expression))
    message = "the input {variable} is taken to read the marker {marker} along {axis}"
    for name, feature in parts.features.items():
        if name not in parts.noted:
            values = name, feature.role, feature.axis
            findings.append(finding("ROLE_ASSUMED", f"{path.name}: {name}", message, *values))
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
