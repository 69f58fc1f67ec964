"""Arguments of public functions and types, checked against their annotations.

A wrong one is refused at the call, in one line, where it would be an AttributeError far inside.
The annotations are the only table: there is nothing to keep in step.
"""

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import wraps
from inspect import unwrap
from operator import index
from reprlib import repr as short
from sys import modules
from types import NoneType, UnionType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin

from usdface.errors import InputError, unreadable
from usdface.read_only import read_only_again

__all__ = ["checked"]

TargetT = TypeVar("TargetT", bound=Callable[..., Any])

# Makers of values by type, for the message.
_MAKERS = {
    "Binding": "usdface.Binding(markers, points)",
    "Calibration": "usdface.calibrate(shot, output).value",
    "MarkerTake": "usdface.read_take(path)",
    "RetargetSetup": "usdface.read_bind(path)",
    "Rig": "usdface.read_rig(path)",
    "Shot": "usdface.assemble_shot(rig, take)",
    "ShotResult": "usdface.retarget(shot)",
    "Stage": "Usd.Stage.Open(path)",
    "WeightsTake": "usdface.read_take(path)",
}
_PLAIN = {str: "text", bool: "True or False", int: "a whole number", float: "a number"}


class _Misfit(Exception):
    """A value that is not of a kind, and where in the argument it is."""

    def __init__(self, value: object, kind: Any, place: str = "") -> None:
        self.value, self.kind, self.place = value, kind, place


def checked(target: TargetT) -> TargetT:
    """Return a function, or a class with its constructor, that refuses arguments of wrong types.

    Files that the system refuses are errors of usdface, too: a folder that may not be entered, a
    name that is too long.

    Iterables are taken for tuples, and sequences of numbers for arrays. The arrays of an unpickled
    or copied instance are read-only again.

    Parameters
    ----------
    target : function or class
        With annotations, which are values and not text. Parameters without one are not checked.

    Examples
    --------
    >>> usdface.retarget("shot.usda")
    Traceback (most recent call last):
    usdface.errors.InputError: retarget(): shot is 'shot.usda'; expected Shot; ...
    """
    if isinstance(target, type):
        target.__init__ = _checked_call(target.__init__, target.__name__)  # type: ignore[misc]
        if hasattr(target, "__setstate__"):
            target.__setstate__ = read_only_again(target.__setstate__)
        return target
    call: TargetT = _checked_call(target, target.__name__)
    return call


def _checked_call(function: Any, title: str) -> Any:
    kinds = {name: kind for name, kind in function.__annotations__.items() if name != "return"}
    code = unwrap(function).__code__
    names = code.co_varnames[: code.co_argcount]

    @wraps(function)
    def call(*given: Any, **named: Any) -> Any:
        def fit(name: str, value: Any) -> Any:
            if name not in kinds:
                return value
            try:
                return _fitted(value, kinds[name])
            except _Misfit as misfit:
                raise InputError(f"{title}(): {name}{_complaint(misfit)}") from None

        placed = [fit(name, value) for name, value in zip(names, given, strict=False)]
        named = {name: fit(name, value) for name, value in named.items()}
        try:
            return function(*placed, *given[len(placed) :], **named)
        except OSError as error:
            if error.filename is None:  # of a callback that prints
                raise
            raise unreadable(error) from error

    return call


def _fitted(value: Any, kind: Any) -> Any:
    """Return a value as its annotation says: an iterable as a tuple, numbers as an array.

    Raises
    ------
    _Misfit
    """
    if type(value) is kind or kind is Any or isinstance(kind, str | TypeVar):
        return value
    origin, inner = get_origin(kind) or kind, get_args(kind)
    if origin in (Union, UnionType):
        return _fitted_to_one(value, kind, inner)
    if origin in (tuple, Sequence, Iterable):
        return _fitted_tuple(value, kind, inner)
    if origin is str and isinstance(value, os.PathLike):
        value = os.fspath(value)  # names of files and folders are text
    if origin is Callable:
        fits = callable(value)
    elif origin is Literal:
        # Of its choices a class has a check with a code of its own.
        return _fitted_to_one(value, kind, tuple({type(choice) for choice in inner}))
    elif (origin.__module__, origin.__name__) == ("numpy", "ndarray"):
        return _fitted_array(value, kind, inner)
    elif origin in (bool, int, float):
        return _fitted_number(value, origin)
    elif isinstance(origin, type):
        fits = isinstance(value, origin)
    else:
        return value
    if not fits:
        raise _Misfit(value, kind)
    if inner and origin is Mapping:
        _fit_all(value.items(), inner[1])
    return value


def _fit_all(items: Iterable[tuple[Any, Any]], kind: Any) -> list[Any]:
    """Return the values of a list or mapping as a kind; a misfit is named by its place."""
    fitted = []
    for key, value in items:
        try:
            fitted.append(_fitted(value, kind))
        except _Misfit as misfit:
            raise _Misfit(misfit.value, misfit.kind, f"[{key!r}]{misfit.place}") from None
    return fitted


def _fitted_to_one(value: Any, kind: Any, kinds: tuple[Any, ...]) -> Any:
    """Return a value as the first of several kinds that it is; a part that misfits is named."""
    # The parts of a misfit: an exception that outlives its handler keeps all frames above alive,
    # with the stages that are open there.
    deepest: tuple[Any, Any, str] = (value, kind, "")
    for each in sorted(kinds, key=lambda one: one is str):  # a path stays one where it may
        try:
            return _fitted(value, each)
        except _Misfit as misfit:
            if misfit.place:
                deepest = (misfit.value, misfit.kind, misfit.place)
    raise _Misfit(*deepest)


def _fitted_tuple(value: Any, kind: Any, kinds: tuple[Any, ...]) -> tuple[Any, ...]:
    """Return what an iterable yields, which is asked once; text is no list of its letters."""
    if isinstance(value, str | bytes):
        raise _Misfit(value, kind)
    try:
        parts = iter(value)
    except TypeError:
        raise _Misfit(value, kind) from None
    if get_origin(kind) is not tuple or kinds[1:] == (...,):
        return tuple(_fit_all(enumerate(parts), kinds[0]))
    listed = tuple(parts)
    if len(kinds) != len(listed):
        raise _Misfit(value, kind)
    return tuple(_fitted(each, own) for each, own in zip(listed, kinds, strict=True))


def _fitted_number(value: Any, kind: type) -> Any:
    """Return a number; of the types of NumPy, too, and no truth value or text as one.

    A whole float is a whole number, and 0 and 1 are truth values.
    """
    if getattr(value, "ndim", None) == 0 and hasattr(value, "item"):
        value = value.item()
    truth, single = isinstance(value, bool), getattr(value, "ndim", 0) == 0
    if kind is bool and isinstance(value, int | float) and value in (0, 1):
        return bool(value)
    if kind is int and isinstance(value, float) and value.is_integer():
        return int(value)
    if kind is int and hasattr(value, "__index__") and single and not truth:
        return index(value)
    if kind is float and hasattr(value, "__float__") and single and not truth:
        return value
    raise _Misfit(value, kind)


def _fitted_array(value: Any, kind: Any, inner: tuple[Any, ...]) -> Any:
    """Return an array, or numbers in lists as one: whole numbers where they are to be such.

    None among real numbers, as in lists and in tables of pandas, is NaN, and so are masked ones.
    """
    np = modules["numpy"]  # whoever has such an annotation has loaded it

    if isinstance(value, np.ma.MaskedArray) and value.dtype.kind in "biuf":
        value = value.astype(float).filled(np.nan) if np.ma.is_masked(value) else value.data
    try:
        array = np.asarray(value)
    except (TypeError, ValueError):
        raise _Misfit(value, kind, ", with rows of several lengths,") from None
    number = get_args(inner[1])[0]
    if array.dtype.kind == "O" and array.ndim and issubclass(number, np.floating):
        try:
            array = array.astype(float)
        except (TypeError, ValueError, OverflowError):
            raise _Misfit(value, kind) from None
    whole = issubclass(number, np.integer)
    if array.dtype.kind not in "biuf" or (
        whole and array.dtype.kind == "f" and (array != np.floor(array)).any()
    ):
        raise _Misfit(value, kind)
    return array


def _complaint(misfit: _Misfit) -> str:
    """Return the end of a message: the value found, the expected one, the remedy."""
    value, kind = misfit.value, misfit.kind
    remedy = _remedy(value, kind)
    return f"{misfit.place} is {_described(value)}; expected {_worded(kind)}{remedy}"


def _described(value: object) -> str:
    kind, plain = type(value).__name__, str | bool | int | float | NoneType
    if isinstance(value, plain):
        return short(value)
    if hasattr(value, "dtype") and hasattr(value, "shape"):
        return f"an array of {value.dtype}, shape {value.shape}"
    if isinstance(value, tuple | list | Mapping) and all(isinstance(v, plain) for v in value):
        return f"the {kind} {short(value)}"
    return f"of type {kind}"


def _worded(kind: Any) -> str:
    """Return an annotation in words."""
    origin, inner = get_origin(kind) or kind, get_args(kind)
    if kind in _PLAIN:
        return _PLAIN[kind]
    if kind in (None, NoneType):
        return "None"
    if origin in (Union, UnionType):
        paths = any(get_origin(each) is os.PathLike for each in inner)
        return " or ".join(_worded(each) for each in inner if not (paths and each is str))
    if origin is Literal:
        return ", ".join(map(repr, inner))
    if origin is os.PathLike:
        return "a path"
    if origin is Callable:
        return "a function"
    if origin is tuple and inner[1:] != (...,):
        return f"({', '.join(map(_worded, inner))})"
    if origin in (tuple, Sequence, Iterable):
        return f"a list of {_worded(inner[0])}"
    if origin.__name__ == "ndarray":
        whole = "int" in get_args(inner[1])[0].__name__
        return f"an array of {'whole' if whole else 'real'} numbers"
    return "a mapping" if origin is Mapping else str(origin.__name__)


def _remedy(value: Any, kind: Any) -> str:
    """Return the remedy where a usual step was left out."""
    ours = type(value).__module__.startswith("usdface.")
    if ours and _fits(getattr(value, "value", None), kind):
        return "; give the value of this result: result.value"
    if isinstance(value, tuple) and value and _fits(value[0], kind):
        return "; give the first of this pair: value, findings = ..."
    kinds = [each for each in get_args(kind) or (kind,) if each is not NoneType]
    names = [getattr(each, "__name__", "") for each in kinds]
    makers = dict.fromkeys(_MAKERS[name] for name in names if name in _MAKERS)
    if makers:
        return f"; {' or '.join(makers)} makes one"
    if ours and any(get_origin(each) is os.PathLike for each in kinds):
        return "; arrays go to usdface.assemble_shot and usdface.retarget"
    return ""


def _fits(value: object, kind: Any) -> bool:
    try:
        _fitted(value, kind)
    except _Misfit:
        return False
    return value is not None
