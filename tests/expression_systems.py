"""Expression systems in one call: settings go to the engine or to the expression system."""

from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Any

from usdface.expression_system import ExpressionSystem, MarkerFeature
from usdface.fuzzy.rules import Rule
from usdface.fuzzy.system import FuzzySystem
from usdface.fuzzy.variables import Variable
from usdface.io.fuzzy_formats.metadata_comments import guessed_feature

__all__ = ["changed", "expression_system"]

_ENGINE = {field.name for field in fields(FuzzySystem)}


def expression_system(
    variables: Sequence[Variable],
    rules: Sequence[Rule],
    features: Sequence[MarkerFeature] | None = None,
    **settings: Any,
) -> ExpressionSystem:
    """Make a system as the designs do: normalised over all rules, with an else rule.

    Without features their names say which ones the inputs read.
    """
    engine = {name: settings.pop(name) for name in _ENGINE & settings.keys()}
    fuzzy = FuzzySystem(
        tuple(variables),
        tuple(rules),
        **({"normalisation": "all_rules", "else_rule": True} | engine),
    )
    read = [guessed_feature(v.name) for v in fuzzy.inputs] if features is None else features
    return ExpressionSystem(fuzzy, tuple(read), **settings)


def changed(system: ExpressionSystem, **engine: Any) -> ExpressionSystem:
    """Return the system with other fields of its engine."""
    return replace(system, fuzzy=replace(system.fuzzy, **engine))
