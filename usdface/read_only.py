"""All arrays in a value made read-only: of a result, and again of an unpickled or copied one."""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from functools import wraps
from sys import modules
from typing import Any

__all__ = ["make_read_only", "read_only_again"]


def read_only_again(restore: Any) -> Any:
    """Return a `__setstate__` that makes all arrays of its instance read-only.

    NumPy forgets the flag when an array is pickled or copied. A shallow copy shares its arrays with
    the original, where they are read-only from then on, too.

    Parameters
    ----------
    restore : function
        The `__setstate__` of a frozen dataclass.
    """

    @wraps(restore)
    def set_state(instance: object, state: object) -> None:
        restore(instance, state)
        if "numpy" in modules:  # else there is no array
            make_read_only(instance)

    return set_state


def make_read_only(value: object) -> None:
    """Make the arrays in a value read-only: in its tuples, lists, mappings and dataclasses."""
    if isinstance(value, modules["numpy"].ndarray):
        value.setflags(write=False)
    elif isinstance(value, Mapping):
        for each in value.values():
            make_read_only(each)
    elif isinstance(value, tuple | list):
        for each in value:
            make_read_only(each)
    elif is_dataclass(value) and not isinstance(value, type):
        for field in fields(value):
            make_read_only(getattr(value, field.name))
