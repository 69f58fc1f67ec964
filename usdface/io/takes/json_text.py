"""JSON files of other programs, read with limits."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from usdface.errors import InputError
from usdface.io.takes.text_table import read_text

__all__ = ["number", "read_json"]


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
