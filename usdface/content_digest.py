"""Digest of a value in memory: immutable dataclasses, arrays and plain values.

Two values with one digest are equal bit by bit.
"""

import hashlib
import struct
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

__all__ = ["content_digest", "known_digest"]


def content_digest(value: object) -> str:
    """Return the SHA-256 of a value's content.

    Raises
    ------
    TypeError
        If a part of it is of a type whose content is not known.
    """
    digest = hashlib.sha256()
    _feed(value, digest.update)
    return digest.hexdigest()


def known_digest(value: object) -> str:
    """Return `content_digest`, or "" of a value that has none: a part from another package."""
    try:
        return content_digest(value)
    except TypeError:
        return ""


def _feed(value: Any, feed: Callable[[bytes], object]) -> None:
    kind = type(value)
    if value is None or kind in (bool, int, str):
        _text(f"{kind.__name__}:{value}", feed)
    elif isinstance(value, float):
        feed(b"float:" + struct.pack("<d", value))
    elif isinstance(value, bytes):
        _text(f"bytes:{len(value)}", feed)
        feed(value)
    elif isinstance(value, np.ndarray | np.generic):
        array = np.asarray(value)
        if array.dtype.hasobject:
            raise TypeError("an array of objects has no digest")
        _text(f"array:{array.dtype.str}{array.shape}", feed)
        feed(np.ascontiguousarray(array).tobytes())
    elif isinstance(value, tuple | list):
        _text(f"{kind.__name__}:{len(value)}", feed)
        for part in value:
            _feed(part, feed)
    elif isinstance(value, Mapping):
        _text(f"mapping:{len(value)}", feed)
        for key, part in value.items():  # in their order, which may show in results
            _feed(key, feed)
            _feed(part, feed)
    elif is_dataclass(value):
        _text(f"{kind.__module__}.{kind.__qualname__}", feed)
        for field in fields(value):
            _text(field.name, feed)
            _feed(getattr(value, field.name), feed)
    else:
        raise TypeError(f"{kind.__qualname__} has no digest")


def _text(text: str, feed: Callable[[bytes], object]) -> None:
    data = text.encode("utf-8", "surrogatepass")
    feed(struct.pack("<q", len(data)))
    feed(data)
