"""Values of a show file: each is checked where it is read, with the place in the file."""

from collections.abc import Mapping
from typing import Any

from usdface.errors import InputError, did_you_mean

__all__ = ["as_list", "as_switch", "as_table", "as_text", "check_keys", "check_number"]


def check_keys(table: Mapping[str, Any], known: tuple[str, ...], where: str) -> None:
    """Refuse a table with keys that are not known."""
    for key in table:
        if key not in known:
            near = did_you_mean(key, known) or f"; known: {', '.join(known)}"
            raise InputError(f"{where}: unknown key {key!r}{near}", "SCHEMA_BROKEN")


def as_table(value: object, where: str) -> dict[str, Any]:
    """Return a value that is a table."""
    if not isinstance(value, dict):
        raise InputError(f"{where} is {value!r}; expected a table", "SCHEMA_BROKEN")
    return value


def as_list(value: object, where: str) -> list[Any]:
    """Return a value that is a list."""
    if not isinstance(value, list):
        raise InputError(f"{where} is {value!r}; expected a list", "SCHEMA_BROKEN")
    return value


def as_text(value: object, where: str) -> str:
    """Return a value that is text, and may be a file name."""
    if not isinstance(value, str) or "\0" in value:
        raise InputError(f"{where} is {value!r}; expected text", "SCHEMA_BROKEN")
    return value


def as_switch(value: object, where: str) -> bool:
    """Return a value that is true or false."""
    if not isinstance(value, bool):
        raise InputError(f"{where} is {value!r}; expected true or false", "SETTING_WRONG")
    return value


def check_number(value: object, where: str) -> None:
    """Refuse a value that is no number."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"{where} is {value!r}; expected a number", "SETTING_WRONG")
