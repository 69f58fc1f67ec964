"""The values of a finding: put into its message for people, plain under their keys for programs."""

import math
import re
from collections.abc import Mapping, Sequence
from string import Formatter
from typing import Any

from usdface.errors import UsdFaceError
from usdface.plain_text import listed, plain

__all__ = ["Prose", "filled_in", "plain_values"]

_LISTED = 8  # names that a message lists
_RUN = 3  # numbers in a row, from which on they are a range
_LONGEST, _MOST = 400, 200  # characters of a text, entries of a list in a report
_DIGITS = 6
_WHOLE = 1e15  # whole numbers below it are exact
# The things that messages count. As a subject, at the start of a sentence, with its verb:
# "{frame_count} neutral frames are left out"; elsewhere alone: "in {frame_count} frames".
_NOUNS = (
    "frames|points|markers|places|weights|joints|samples|nodes|meshes|keys|instances|images|faces|"
    "blinks|Xforms|vertices|curves|shapes|targets|eyes|dots|rows|pulses|materials|coordinates|"
    "cameras|corners"
)
_OTHER_SINGULARS = {"meshes": "mesh", "vertices": "vertex"}
_VERBS = {"are": "is", "were": "was", "have": "has"}
_COUNT = r"\{(\w+)(?::\w+)?\} (?:(?!of )[a-z-]+ ){0,2}?"
_SUBJECT = re.compile(rf"((?:^|[:;] ){_COUNT})({_NOUNS}) ({'|'.join(_VERBS)})\b")
_OBJECT = re.compile(rf"((?<=.){_COUNT})({_NOUNS})\b(?! (?:{'|'.join(_VERBS)}|hold|lie)\b)()")
_PART = re.compile(rf"((?<=of ){_COUNT})({_NOUNS})\b()")
_ONE_FRAME = {
    "frames {first_frame} to {last_frame}": "frame {first_frame}",
    "{first_frame} to {last_frame}": "{first_frame}",
}


class Prose(str):
    """Text for the message alone, not a value of a report."""

    __slots__ = ()


class _Template(Formatter):
    """A template that formats lists of names, and values of other types as text."""

    def format_field(self, value: Any, format_spec: str) -> str:
        if isinstance(value, Sequence) and not isinstance(value, str):
            return listed(_in_runs(value), _LISTED)
        return format(value, format_spec) if format_spec else str(value)


def _in_runs(values: Sequence[Any]) -> Sequence[Any]:
    """Return whole numbers with those that follow one another as "3 to 9"; others as they are."""
    if not all(type(value) is int for value in values):
        return values
    runs: list[list[int]] = []
    for value in values:
        if runs and value == runs[-1][-1] + 1:
            runs[-1].append(value)
        else:
            runs.append([value])
    return [
        text for run in runs for text in (run if len(run) < _RUN else [f"{run[0]} to {run[-1]}"])
    ]


_TEMPLATE = _Template()


def filled_in(template: str, values: Sequence[object]) -> tuple[str, dict[str, object]]:
    """Fill a template with values, in the order in which their keys first appear.

    Parameters
    ----------
    template : str
        ``"occluded in {occluded_count} of {frame_count} frames"``: written by us, never by a file.
    values : sequence
        Numbers, names, lists of names, errors.

    Returns
    -------
    text : str
    named : dict of str to object
        The values by their keys.

    Raises
    ------
    ValueError
        If there are more or fewer values than keys.
    """
    keys = dict.fromkeys(key for _, key, _, _ in _TEMPLATE.parse(template) if key)
    named = dict(zip(keys, values, strict=True))
    return _TEMPLATE.vformat(_counted(template, named), (), named), named


def _counted(template: str, named: Mapping[str, object]) -> str:
    """Return the template in the singular where it is about one thing."""

    def singular(found: re.Match[str]) -> str:
        before, key, noun, verb = found.groups()
        if named.get(key) != 1:
            return found.group()
        return before + _OTHER_SINGULARS.get(noun, noun[:-1]) + (f" {_VERBS[verb]}" if verb else "")

    for form in (_SUBJECT, _OBJECT, _PART):
        template = form.sub(singular, template)
    if "first_frame" in named and named["first_frame"] == named.get("last_frame"):
        for many, one in _ONE_FRAME.items():
            template = template.replace(many, one)
    return template


def plain_values(values: Mapping[str, object]) -> dict[str, Any]:
    """Return values as those of JSON: an error is its code, prose is left out."""
    return {key: _plain(value) for key, value in values.items() if not isinstance(value, Prose)}


def _plain(value: object) -> Any:
    if isinstance(value, BaseException):
        return value.code if isinstance(value, UsdFaceError) else type(value).__name__
    if hasattr(value, "tolist"):  # of numpy
        value = value.tolist()
    if isinstance(value, bool | int) or value is None:
        return value
    if isinstance(value, float):
        if value.is_integer() and abs(value) < _WHOLE:
            return int(value)
        return float(f"{value:.{_DIGITS}g}") if math.isfinite(value) else None
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [_plain(each) for each in value[:_MOST]]
    return plain(str(value), _LONGEST)
