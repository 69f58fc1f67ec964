"""Authoring of schema attributes, and reading with a check of their type."""

from typing import Any

from pxr import Sdf, Usd

from usdface.errors import InputError

__all__ = ["author", "changes", "strings_of", "value_of", "value_or"]


def author(
    prim: Usd.Prim,
    name: str,
    kind: Sdf.ValueTypeName,
    value: object,
    variability: Sdf.Variability = Sdf.VariabilityUniform,
) -> None:
    """Author one value, as a schema attribute: not custom."""
    prim.CreateAttribute(name, kind, False, variability).Set(value)


def value_of(prim: Usd.Prim, name: str, kind: type) -> Any:
    """Return the value of an attribute, None where there is none.

    Raises
    ------
    InputError
        If it is of another type than `kind`; the message does not name the prim.
    """
    attribute = prim.GetAttribute(name)
    value = attribute.Get() if attribute else None
    if value is not None and not isinstance(value, kind):
        raise InputError(f"{name} holds a {type(value).__name__}; expected a {kind.__name__}")
    return value


def changes(attribute: Usd.Attribute) -> bool:
    """Return whether values differ over time; exporters repeat the same one for each frame."""
    codes = attribute.GetTimeSamples()
    if not codes:
        return bool(attribute.HasSpline())
    first = attribute.Get(codes[0])
    return any(attribute.Get(code) != first for code in codes[1:])


def value_or(prim: Usd.Prim, name: str, default: Any) -> Any:
    """Return the value of an attribute, `default` where there is none."""
    value = prim.GetAttribute(name).Get() if prim.HasAttribute(name) else None
    return default if value is None else value


def strings_of(prim: Usd.Prim, name: str) -> tuple[str, ...]:
    """Return the values of an attribute as strings, empty where there are none."""
    return tuple(str(entry) for entry in value_or(prim, name, ()))
