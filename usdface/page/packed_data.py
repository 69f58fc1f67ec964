"""The data of a page: a tree of plain values and arrays, as JSON and one block of bytes.

Arrays go to the block. The page undoes it (`assets/data.js`). Whole and quantised numbers are
stored as the differences of neighbouring rows, modulo the size of their type, which compresses
curves and sorted indices well.
"""

import base64
import gzip
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from usdface.arrays import FloatArray, freeze

__all__ = ["PageData", "Quantized", "pack_data"]

# Bytes that an array of the block begins at a multiple of: the largest item.
_ALIGNED = 4


@dataclass(frozen=True, eq=False, slots=True)
class Quantized:
    """Numbers in steps of their range over 2**bits - 2; NaN has a code of its own.

    Attributes
    ----------
    values : (N, ...) float64
    bits : {8, 16}
    """

    values: FloatArray
    bits: int = 16

    def __post_init__(self) -> None:
        freeze(self, "values")


@dataclass(frozen=True, slots=True)
class PageData:
    """The data of a page: `text` is JSON; `block` is base64 of the compressed arrays."""

    text: str
    block: str


def pack_data(tree: Mapping[str, Any]) -> PageData:
    """Pack a tree of dicts, lists, plain values, arrays and `Quantized` arrays.

    Arrays are of whole numbers from 0, or float32, and come back exactly. The same tree
    always gives the same bytes.

    Raises
    ------
    TypeError
        If it holds another array.
    """
    parts: list[bytes] = []
    size = 0

    def stored(array: np.ndarray[Any, Any]) -> dict[str, Any]:
        nonlocal size
        rows = array.reshape(len(array), -1) if array.size else array.reshape(0, 1)
        steps = np.diff(rows, axis=0, prepend=np.zeros((1, rows.shape[1]), array.dtype))
        kind = f"{array.dtype.kind}{8 * array.dtype.itemsize}"
        values = steps if array.dtype.kind == "u" else rows
        data = np.ascontiguousarray(values, array.dtype.newbyteorder("<")).tobytes()
        entry = {"at": size, "type": kind, "shape": list(array.shape)}
        data += bytes(-len(data) % _ALIGNED)
        parts.append(data)
        size += len(data)
        return entry

    def plain(value: Any) -> Any:
        if isinstance(value, Quantized):
            codes, low, step = _quantized(value)
            return {"array": stored(codes) | {"low": low, "step": step}}
        if isinstance(value, np.ndarray):
            return {"array": stored(value if value.dtype == np.float32 else _smallest(value))}
        if isinstance(value, Mapping):
            return {str(key): plain(each) for key, each in value.items()}
        if isinstance(value, Sequence) and not isinstance(value, str):
            return [plain(each) for each in value]
        if isinstance(value, float) and not math.isfinite(value):
            return None  # JSON has no such number
        return value

    text = json.dumps(plain(tree), ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    block = gzip.compress(b"".join(parts), 9, mtime=0)
    return PageData(text, base64.b64encode(block).decode("ascii"))


def _smallest(values: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Return whole numbers from 0 in the smallest type that holds them."""
    if values.dtype.kind not in "biu":
        raise TypeError(f"an array of {values.dtype} has to be quantised")
    largest = int(values.max(initial=0))
    kind = np.uint8 if largest < 2**8 else np.uint16 if largest < 2**16 else np.uint32
    return values.astype(kind)


def _quantized(given: Quantized) -> tuple[np.ndarray[Any, Any], float, float]:
    """Return the codes of numbers, the number of code 0, and the step between two codes."""
    kind = np.dtype(np.uint8 if given.bits == 8 else np.uint16)
    missing = 2**given.bits - 1
    seen = np.isfinite(given.values)
    low = float(given.values.min(where=seen, initial=np.inf)) if seen.any() else 0.0
    high = float(given.values.max(where=seen, initial=-np.inf)) if seen.any() else 0.0
    step = (high - low) / (missing - 1)
    codes = np.full(given.values.shape, missing, kind)
    codes[seen] = np.rint((given.values[seen] - low) / step) if step > 0 else 0
    return codes, low, step
