"""A repr of one line for values that hold arrays, in a notebook or a debugger."""

from dataclasses import MISSING, Field, fields, is_dataclass
from reprlib import Repr
from typing import Any

__all__ = ["short_repr"]


class _Short(Repr):
    """Arrays by their shape, and dataclasses within by their type alone."""

    def __init__(self) -> None:
        super().__init__()
        self.maxtuple = self.maxlist = self.maxdict = 4
        self.maxlevel = 2
        self.maxstring = self.maxother = 60

    def repr1(self, x: Any, level: int) -> str:
        if hasattr(x, "dtype") and hasattr(x, "shape") and x.shape:
            return f"<{' x '.join(map(str, x.shape))} {x.dtype}>"
        if is_dataclass(x):
            return f"{type(x).__name__}(...)"
        return super().repr1(x, level)


_short = _Short()


def short_repr(value: Any) -> str:
    """Return the repr of a dataclass, without the fields that have their default.

    The repr of the dataclass itself would be all numbers of a whole shot: assign this one to
    ``__repr__`` in its body.
    """
    shown = [
        f"{field.name}={_short.repr(getattr(value, field.name))}"
        for field in fields(value)
        if not _is_default(getattr(value, field.name), field)
    ]
    return f"{type(value).__name__}({', '.join(shown)})"


def _is_default(value: object, field: "Field[Any]") -> bool:
    default = field.default
    if field.default_factory is not MISSING:
        default = field.default_factory()
    return value is default or (type(value) is type(default) and bool(value == default))
