"""Expression poses as JSON: which blend shapes an emotion is, and how strongly.

::

    {"contempt": {"shapes": {"mouthSmile_L": 0.7, "mouthDimple_L": 0.4}, "gain": 0.8},
     "joy": {"shapes": {"mouthSmile_L": 0.9, "mouthSmile_R": 0.9}}}
"""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from usdface.errors import InputError
from usdface.io.takes.text_table import read_text
from usdface.setup import Expression

__all__ = ["expressions_json", "read_expressions_file"]

_LARGEST = 16_000_000  # bytes
_LARGEST_GAIN = 1e6
_DIGITS = 6


def read_expressions_file(path: Path) -> tuple[Expression, ...]:
    """Read expression poses.

    Raises
    ------
    InputError
        If the file is missing or not of the form above; the message names the expression.
    """
    if path.is_file() and path.stat().st_size > _LARGEST:
        raise InputError(f"{path} is larger than any file of expressions; expected a small one")
    try:
        document = json.loads(read_text(path))
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path} is no JSON that can be read: {error}") from error
    if not isinstance(document, dict) or not document:
        raise InputError(f'{path}: expected an object, e.g. {{"joy": {{"shapes": {{...}}}}}}')
    return tuple(_expression(path, name, value) for name, value in document.items())


def _expression(path: Path, name: str, value: object) -> Expression:
    where = f"{path}: expression {name!r}"
    if not name.isidentifier():
        raise InputError(f"{where} must be called by one word of letters, digits and _")
    if not isinstance(value, dict) or not set(value) <= {"shapes", "gain"}:
        raise InputError(
            f'{where} is {value!r}; expected {{"shapes": {{name: weight}}, "gain": 1}}'
        )
    shapes, gain = value.get("shapes"), value.get("gain", 1.0)
    if not isinstance(shapes, dict) or not shapes:
        raise InputError(f'{where} has no "shapes"; expected an object of names and weights')
    for what, number in (*shapes.items(), ("gain", gain)):
        if (
            not isinstance(number, (int, float))
            or isinstance(number, bool)
            or not 0 <= number < 1e6
        ):
            raise InputError(f"{where}: {what} is {number!r}; expected a number, 0 or more")
    try:
        return Expression(name, tuple(shapes), np.array([float(w) for w in shapes.values()]), gain)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def expressions_json(expressions: Sequence[Expression]) -> str:
    """Return expression poses as `read_expressions_file` reads them."""
    document = {
        e.name: {
            "shapes": {
                shape: round(float(weight), _DIGITS)
                for shape, weight in zip(e.shapes, e.weights, strict=True)
            },
            "gain": e.gain,
        }
        for e in expressions
    }
    return json.dumps(document, indent=1, ensure_ascii=False) + "\n"
