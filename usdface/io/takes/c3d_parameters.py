"""The parameter section of a C3D file, read without trusting any of its counts.

Layout after the C3D User Guide (c3d.org), "The parameter section". Every length is
checked against the section before it is used, which the C++ readers do not do.
"""

from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from usdface.arrays import FloatArray
from usdface.errors import InputError

__all__ = [
    "ByteOrder",
    "Parameters",
    "floats",
    "labels_of",
    "number_of",
    "read_parameters",
    "text_of",
    "texts_of",
]

ByteOrder: TypeAlias = Literal["intel", "dec", "mips"]
Parameters: TypeAlias = dict[str, FloatArray | list[str]]  # "POINT:RATE" -> numbers or texts

# Bytes by type code (text, byte, word, float), and dimensions: C3D User Guide.
_ITEM_BYTES = {-1: 1, 1: 1, 2: 2, 4: 4}
_MOST_DIMENSIONS = 7
_MOST_LISTS = 258  # of LABELS, LABELS2, ...: 255 labels each, of 65535 channels


def floats(raw: NDArray[np.uint8] | bytes, order: ByteOrder) -> FloatArray:
    """Return the 4-byte floats in `raw`, of any of the three byte orders.

    DEC (VAX F) floats hold their 16-bit words in the other order and count their
    exponent from another origin: four times the IEEE number.
    """
    if order == "dec":
        words = np.frombuffer(raw, "<u2").reshape(-1, 2)[:, ::-1]
        return np.ascontiguousarray(words).view("<f4").ravel().astype(np.float64) / 4
    return np.frombuffer(raw, ">f4" if order == "mips" else "<f4").astype(np.float64)


def read_parameters(path: Path, section: bytes, order: ByteOrder) -> Parameters:
    """Return every parameter by "GROUP:NAME" in capitals.

    Numbers come flat; texts come as one string for each of the last dimensions.

    Raises
    ------
    InputError
        If a length points beyond the section.
    """
    groups: dict[int, str] = {}
    found: list[tuple[int, str, FloatArray | list[str]]] = []
    at = 4
    while at + 2 <= len(section) and section[at]:
        name_length, group = np.frombuffer(section, np.int8, 2, at).tolist()
        after_name = at + 2 + abs(name_length)
        name = section[at + 2 : after_name].decode("latin-1").upper()
        step = _word(section, after_name, order)
        if step is None:
            raise _damaged(path, name)
        if group < 0:
            groups[-group] = name
        elif group:
            found.append((group, name, _value(path, name, section, after_name + 2, order)))
        if step == 0:
            break
        at = after_name + step
    return {f"{groups.get(group, group)}:{name}": value for group, name, value in found}


def number_of(parameters: Parameters, key: str, missing: float) -> float:
    """Return the first number of a parameter; `missing` where it has no finite one."""
    value = parameters.get(key)
    if value is None or isinstance(value, list) or not len(value) or not np.isfinite(value[0]):
        return missing
    return float(value[0])


def texts_of(parameters: Parameters, key: str) -> list[str]:
    """Return the texts of a parameter, none where it has none."""
    value = parameters.get(key)
    return value if isinstance(value, list) else []


def text_of(parameters: Parameters, key: str) -> str:
    """Return the first text of a parameter, "" where it has none."""
    return next(iter(texts_of(parameters, key)), "")


def labels_of(parameters: Parameters, group: str) -> list[str]:
    """Return the labels of a group, from its LABELS, LABELS2, ... up to the first without any."""
    labels: list[str] = []
    for key in [f"{group}:LABELS", *(f"{group}:LABELS{n}" for n in range(2, _MOST_LISTS))]:
        if not (texts := texts_of(parameters, key)):
            break
        labels += texts
    return labels


def _value(
    path: Path, name: str, section: bytes, at: int, order: ByteOrder
) -> FloatArray | list[str]:
    if at + 2 > len(section):
        raise _damaged(path, name)
    kind = int(np.frombuffer(section, np.int8, 1, at)[0])
    rank = section[at + 1]
    shape = list(section[at + 2 : at + 2 + rank])
    start = at + 2 + rank
    if kind not in _ITEM_BYTES or rank > _MOST_DIMENSIONS or len(shape) < rank:
        raise _damaged(path, name)
    size = _ITEM_BYTES[kind]
    for count in shape:
        size *= count
    raw = section[start : start + size]
    if len(raw) < size:
        raise _damaged(path, name)
    if kind == -1:
        width = shape[0] if shape else 1
        texts = [raw[i : i + width] for i in range(0, len(raw), width)] if width else []
        return [_text(item) for item in texts]
    if kind == 4:
        return floats(raw, order)
    # unsigned, because counts beyond 32767 are written so
    dtype = "u1" if kind == 1 else (">u2" if order == "mips" else "<u2")
    return np.frombuffer(raw, dtype).astype(np.float64)


def _text(raw: bytes) -> str:
    try:
        return raw.decode("utf-8").strip(" \0")
    except UnicodeDecodeError:
        return raw.decode("latin-1").strip(" \0")


def _word(section: bytes, at: int, order: ByteOrder) -> int | None:
    if at + 2 > len(section):
        return None
    return int.from_bytes(section[at : at + 2], "big" if order == "mips" else "little")


def _damaged(path: Path, name: str) -> InputError:
    return InputError(
        f"{path}: the C3D parameter {name[:40]!r} reaches beyond its section; is the file damaged?",
        "SCHEMA_BROKEN",
    )
