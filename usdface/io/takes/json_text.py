"""JSON files of other programs, read with limits."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from usdface.arrays import FloatArray
from usdface.errors import InputError
from usdface.io.takes.text_table import read_text

__all__ = ["number", "numbers", "read_json"]


def read_json(path: Path) -> Any:
    """Return the value of a JSON file; its numbers may be NaN or infinite.

    Raises
    ------
    InputError
        If the file is missing, unreadable, or no JSON.
    """
    text = read_text(path)
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(
            f"{path} is no JSON: {error}; is it cut off, or in another format?", "SCHEMA_BROKEN"
        ) from error


def number(value: object) -> float:
    """Return a number as float; NaN for anything else."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return np.nan
    try:
        return float(value)
    except OverflowError:
        return np.nan


def numbers(values: object, count: int) -> FloatArray:
    """Return the first `count` numbers of a list; NaN for other values."""
    listed = list(values)[:count] if isinstance(values, list | tuple) else []
    return np.array([number(value) for value in listed] + [np.nan] * (count - len(listed)))
