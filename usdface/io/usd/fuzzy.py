"""An expression system as USD prims (`docs/architecture.md`), so that a shot can override one rule.

Reading needs no registered schema: types are compared by name, and an attribute that is not
there has the default of the schema.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
from pxr import Gf, Sdf, Tf, Usd, Vt

from usdface.errors import InputError, OutputError
from usdface.expression_system import ExpressionSystem, MarkerFeature
from usdface.fuzzy.rule_parser import parse_rule
from usdface.fuzzy.rules import Rule
from usdface.fuzzy.system import FuzzySystem
from usdface.fuzzy.variables import Term, Variable
from usdface.io.prim_names import prim_names
from usdface.io.usd.attributes import author, value_of
from usdface.schemas import tokens

__all__ = ["read_fuzzy", "write_fuzzy"]

_Read = TypeVar("_Read")
_NAMES = Sdf.ValueTypeNames
# Always authored.
_FUZZY = {tokens.NORMALISATION: "normalisation", tokens.AND: "and_"}
_EXPRESSION = {
    tokens.SPACE: "space",
    tokens.FACE_UNIT: "face_unit",
    tokens.MODE: "mode",
}
# Authored where they are not the default.
_INFERENCE = {
    tokens.INFERENCE: "inference",
    tokens.OR: "or_",
    tokens.IMPLICATION: "implication",
    tokens.AGGREGATION: "aggregation",
    tokens.DEFUZZIFIER: "defuzzifier",
    tokens.SAMPLING: "sampling",
}
_NUMBERS = {
    tokens.FEATURE_SMOOTHING: "smoothing",
    tokens.BLEND_TIME: "blend_time",
    tokens.EASE: "ease",
    tokens.EVIDENCE: "evidence",
    tokens.LIKENESS: "likeness",
}
_DEFAULT = FuzzySystem((), (), normalisation="all_rules", else_rule=True)
_INPUT = {
    tokens.VARIABLE_ROLE: "role",
    tokens.VARIABLE_AXIS: "axis",
    tokens.VARIABLE_MEASURE: "measure",
}


def write_fuzzy(stage: Usd.Stage, path: str, system: ExpressionSystem) -> None:
    """Author an expression system at `path` on the stage's edit target.

    Raises
    ------
    OutputError
        If the path or a name is not one that USD allows, or a prim with children is there.
    """
    fuzzy = system.fuzzy
    try:
        prim = stage.DefinePrim(path, tokens.FUZZY_SYSTEM)
        if prim.GetChildren():
            raise OutputError(f"prim <{path}> already has children; remove it to write it anew")
        for name, field in _FUZZY.items():
            author(prim, name, _NAMES.Token, getattr(fuzzy, field))
        for name, field in _EXPRESSION.items():
            author(prim, name, _NAMES.Token, getattr(system, field))
        for name, field in _INFERENCE.items():
            if getattr(fuzzy, field) != getattr(_DEFAULT, field):
                author(prim, name, _NAMES.Token, getattr(fuzzy, field))
        if fuzzy.samples != _DEFAULT.samples:
            author(prim, tokens.SAMPLES, _NAMES.Int, fuzzy.samples)
        author(prim, tokens.NEUTRAL_RULE, _NAMES.Bool, fuzzy.else_rule)
        author(prim, tokens.RESPONSE, _NAMES.Double2, Gf.Vec2d(*system.response))
        for name, field in _NUMBERS.items():
            author(prim, name, _NAMES.Double, getattr(system, field))
        author(prim, tokens.GAIN, _NAMES.Float, system.gain, Sdf.VariabilityVarying)
        read = dict(zip((v.name for v in fuzzy.inputs), system.features, strict=True))
        for variable in fuzzy.variables:
            child = stage.DefinePrim(f"{path}/{variable.name}", tokens.FUZZY_VARIABLE)
            _write_variable(child, variable, read.get(variable.name))
        taken = [variable.name for variable in fuzzy.variables]
        wanted = [f"rule_{i + 1:02d}" for i in range(len(fuzzy.rules))]
        for name, rule in zip(prim_names(wanted, taken), fuzzy.rules, strict=True):
            _write_rule(stage.DefinePrim(f"{path}/{name}", tokens.FUZZY_RULE), rule)
    except Tf.ErrorException as error:
        reason = str(error).strip().splitlines()[-1].strip()
        raise OutputError(f"cannot write the fuzzy system to <{path}>: {reason}") from error


def _write_variable(prim: Usd.Prim, variable: Variable, feature: MarkerFeature | None) -> None:
    author(prim, tokens.VARIABLE_KIND, _NAMES.Token, variable.kind)
    if variable.range is not None:
        author(prim, tokens.VARIABLE_RANGE, _NAMES.Double2, Gf.Vec2d(*variable.range))
    if variable.default:
        author(prim, tokens.VARIABLE_DEFAULT, _NAMES.Double, variable.default)
    if feature is not None:
        for name, field in _INPUT.items():
            author(prim, name, _NAMES.Token, getattr(feature, field))
    elif not variable.terms:
        return
    terms = variable.terms
    parameters = [p for term in terms for p in term.parameters]
    counts = [len(term.parameters) for term in terms]
    author(prim, tokens.TERMS_NAMES, _NAMES.TokenArray, Vt.TokenArray([t.name for t in terms]))
    author(prim, tokens.TERMS_KINDS, _NAMES.TokenArray, Vt.TokenArray([t.kind for t in terms]))
    author(prim, tokens.TERMS_PARAMETERS, _NAMES.DoubleArray, Vt.DoubleArray(parameters))
    author(prim, tokens.TERMS_COUNTS, _NAMES.IntArray, Vt.IntArray(counts))


def _write_rule(prim: Usd.Prim, rule: Rule) -> None:
    author(prim, tokens.RULE_TEXT, _NAMES.String, rule.text)
    author(prim, tokens.RULE_WEIGHT, _NAMES.Float, rule.weight, Sdf.VariabilityVarying)
    author(prim, tokens.ENABLED, _NAMES.Bool, rule.enabled, Sdf.VariabilityVarying)


def read_fuzzy(stage: Usd.Stage, path: str) -> ExpressionSystem:
    """Read the expression system at `path`, as composed from all layers.

    Inactive variables and rules are left out.

    Raises
    ------
    InputError
        If there is none, or a value cannot be used; the message names the prim.
    """
    prim = stage.GetPrimAtPath(path) if Sdf.Path.IsValidPathString(path) else None
    if not prim or prim.GetTypeName() != tokens.FUZZY_SYSTEM:
        raise InputError(f"prim <{path}> is not a {tokens.FUZZY_SYSTEM}")
    variables, features, rules = [], [], []
    for child in prim.GetChildren():
        if child.GetTypeName() == tokens.FUZZY_VARIABLE:
            variables.append(_checked(child, _read_variable))
            if variables[-1].kind == "input":
                features.append(_checked(child, _read_feature))
        elif child.GetTypeName() == tokens.FUZZY_RULE:
            rules.append(_checked(child, _read_rule))
    fuzzy = _checked(prim, lambda p: _read_system(p, tuple(variables), tuple(rules)))
    return _checked(prim, lambda p: _read_expression(p, fuzzy, tuple(features)))


def _checked(prim: Usd.Prim, read: Callable[[Usd.Prim], _Read]) -> _Read:
    """Name the prim in an error of `read`."""
    try:
        return read(prim)
    except InputError as error:
        # A rule names its prim by itself.
        prefix = "" if str(error).startswith("prim <") else f"prim <{prim.GetPath()}>: "
        raise InputError(f"{prefix}{error}") from error


def _read_system(
    prim: Usd.Prim, variables: tuple[Variable, ...], rules: tuple[Rule, ...]
) -> FuzzySystem:
    settings: dict[str, Any] = _tokens(prim, _FUZZY | _INFERENCE)
    if (samples := value_of(prim, tokens.SAMPLES, int)) is not None:
        settings["samples"] = samples
    if (flag := value_of(prim, tokens.NEUTRAL_RULE, bool)) is not None:
        settings["else_rule"] = flag
    return replace(_DEFAULT, variables=variables, rules=rules, **settings)


def _read_expression(
    prim: Usd.Prim, fuzzy: FuzzySystem, features: tuple[MarkerFeature, ...]
) -> ExpressionSystem:
    settings: dict[str, Any] = _tokens(prim, _EXPRESSION)
    if (response := value_of(prim, tokens.RESPONSE, Gf.Vec2d)) is not None:
        settings["response"] = tuple(response)
    for name, field in _NUMBERS.items():
        if (number := value_of(prim, name, float)) is not None:
            settings[field] = number
    if (gain := _float(prim, tokens.GAIN)) is not None:
        settings["gain"] = gain
    return ExpressionSystem(fuzzy, features, **settings)


def _read_variable(prim: Usd.Prim) -> Variable:
    kind: Any = value_of(prim, tokens.VARIABLE_KIND, str) or "input"
    names = _array(prim, tokens.TERMS_NAMES, Vt.TokenArray)
    kinds = _array(prim, tokens.TERMS_KINDS, Vt.TokenArray)
    counts = _array(prim, tokens.TERMS_COUNTS, Vt.IntArray)
    parameters = _array(prim, tokens.TERMS_PARAMETERS, Vt.DoubleArray)
    if not len(names) == len(kinds) == len(counts):
        raise InputError(
            f"{len(names)} terms have {len(kinds)} kinds and {len(counts)} counts of parameters"
        )
    if min(counts, default=0) < 0 or sum(counts) != len(parameters):
        raise InputError(f"{len(parameters)} parameters of terms; expected {sum(counts)}")
    ends = [sum(counts[: i + 1]) for i in range(len(counts))]
    terms = tuple(
        Term(name, kind_, tuple(parameters[end - count : end]))
        for name, kind_, count, end in zip(names, kinds, counts, ends, strict=True)
    )
    settings: dict[str, Any] = {}
    if (bounds := value_of(prim, tokens.VARIABLE_RANGE, Gf.Vec2d)) is not None:
        settings["range"] = tuple(bounds)
    if (default := value_of(prim, tokens.VARIABLE_DEFAULT, float)) is not None:
        settings["default"] = default
    return Variable(prim.GetName(), kind, terms=terms, **settings)


def _read_feature(prim: Usd.Prim) -> MarkerFeature:
    settings: dict[str, Any] = {"role": "", **_tokens(prim, _INPUT)}
    return MarkerFeature(**settings)


def _read_rule(prim: Usd.Prim) -> Rule:
    weight = _float(prim, tokens.RULE_WEIGHT)
    enabled = value_of(prim, tokens.ENABLED, bool)
    return parse_rule(
        value_of(prim, tokens.RULE_TEXT, str) or "",
        1.0 if weight is None else weight,
        True if enabled is None else enabled,
        f"prim <{prim.GetPath()}>",
    )


def _tokens(prim: Usd.Prim, table: dict[str, str]) -> dict[str, Any]:
    """Return the fields of `table` that are authored."""
    found = {field: value_of(prim, name, str) for name, field in table.items()}
    return {field: value for field, value in found.items() if value is not None}


def _array(prim: Usd.Prim, name: str, kind: type) -> list[Any]:
    value = value_of(prim, name, kind)
    return [] if value is None else list(value)


def _float(prim: Usd.Prim, name: str) -> float | None:
    """Return a number as its shortest decimal: 0.7 is written as a float, and is read as 0.7."""
    value = value_of(prim, name, float)
    return None if value is None else float(str(np.float32(value)))
