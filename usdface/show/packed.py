"""Results of a stage as a file: NumPy's .npz, with the structure of the values as JSON.

No code is in the file: classes are those that the reader allows, and are made by their
constructors, which check them. Nothing is compressed, so no file is larger in memory than on disk.
"""

import io
import json
import zipfile
from collections.abc import Iterable, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from usdface.errors import UsdFaceError
from usdface.io.atomic import atomic_path

__all__ = ["UnpackError", "read_packed", "write_packed"]

_TREE = "tree"
_LARGEST = 2**33  # bytes
_DEEPEST = 60
_KINDS = "biuf"  # of dtypes: numbers


class UnpackError(Exception):
    """A file that `write_packed` did not write, or that is damaged."""


def write_packed(
    path: Path, value: object, classes: Iterable[type], given: Mapping[str, object]
) -> None:
    """Write a value to a file, atomically.

    Parameters
    ----------
    path : Path
        .npz.
    value : dataclass, tuple, list, mapping with str keys, array or plain value
    classes : iterable of dataclass types
        Those that `read_packed` will allow.
    given : mapping of str to object
        Parts of it that the reader has, and that are left out.

    Raises
    ------
    TypeError
        If a part of it is of another type.
    OutputError
        If the file cannot be written.
    """
    arrays: dict[str, NDArray[Any]] = {}
    known = {id(part): name for name, part in given.items() if part is not None}
    tree = _packed(value, arrays, frozenset(classes), known)
    text = json.dumps(tree).encode()
    arrays[_TREE] = np.frombuffer(text, np.uint8)
    with atomic_path(path) as temporary:
        np.savez(temporary, **arrays)  # type: ignore[arg-type]


def _packed(
    value: Any,
    arrays: dict[str, NDArray[Any]],
    classes: frozenset[type],
    known: Mapping[int, str],
) -> Any:
    """Return a value as plain values: lists begin with their kind."""

    def inner(part: Any) -> Any:
        return _packed(part, arrays, classes, known)

    if id(value) in known:
        return ["given", known[id(value)]]
    if value is None or type(value) in (bool, int, str):
        return value
    if isinstance(value, float):
        return float(value)
    if isinstance(value, np.ndarray | np.generic):
        array, kind = np.asarray(value), "array" if isinstance(value, np.ndarray) else "scalar"
        if array.dtype.kind not in _KINDS:
            raise TypeError(f"an array of {array.dtype} is not kept")
        name = f"a{len(arrays)}"
        arrays[name] = array
        return [kind, name]
    if isinstance(value, tuple | list):
        return [type(value).__name__, *(inner(part) for part in value)]
    if isinstance(value, Mapping):
        if not all(type(key) is str for key in value):
            raise TypeError("a mapping whose keys are no names is not kept")
        return ["dict", *([key, inner(part)] for key, part in value.items())]
    if type(value) in classes:
        parts = [[f.name, inner(getattr(value, f.name))] for f in fields(value)]
        return ["class", type(value).__name__, *parts]
    raise TypeError(f"{type(value).__qualname__} is not kept")


def read_packed(path: Path, classes: Iterable[type], given: Mapping[str, object]) -> Any:
    """Return the value of a file.

    Parameters
    ----------
    path : Path
    classes : iterable of dataclass types
        Those that may be in it.
    given : mapping of str to object
        The parts that were left out.

    Raises
    ------
    UnpackError
        If the file is none that `write_packed` wrote.
    FileNotFoundError
        If there is none.
    """
    try:
        arrays = _arrays(path)
        tree = json.loads(arrays.pop(_TREE).tobytes())
        return _value(tree, arrays, {kind.__name__: kind for kind in classes}, given, 0)
    except FileNotFoundError:
        raise
    except (
        *(OSError, ValueError, TypeError, KeyError, IndexError, AttributeError, RecursionError),
        *(zipfile.BadZipFile, NotImplementedError, EOFError, MemoryError, UsdFaceError),
    ) as error:
        raise UnpackError(f"{path}: {error}") from error


def _arrays(path: Path) -> dict[str, NDArray[Any]]:
    size = path.stat().st_size
    if size > _LARGEST or not path.is_file():
        raise ValueError("the file is too large")
    with zipfile.ZipFile(path) as archive:
        entries = archive.infolist()
        stored = all(
            entry.compress_type == zipfile.ZIP_STORED and entry.file_size == entry.compress_size
            for entry in entries
        )
        if not stored or sum(entry.file_size for entry in entries) > size:
            raise ValueError("an entry is compressed, or larger than the file")
        return {e.filename.removesuffix(".npy"): _array(archive.read(e)) for e in entries}


def _array(data: bytes) -> NDArray[Any]:
    """Return the array of a .npy, without memory for more than is there."""
    stream = io.BytesIO(data)
    if np.lib.format.read_magic(stream) != (1, 0):
        raise ValueError("an array is of another version")
    shape, fortran, dtype = np.lib.format.read_array_header_1_0(stream)
    start = stream.tell()
    count = int(np.prod([int(length) for length in shape], dtype=object))
    if dtype.kind not in _KINDS or min(shape, default=0) < 0:
        raise ValueError("an array does not hold numbers")
    if count * dtype.itemsize != len(data) - start:
        raise ValueError("an array has another size than its header says")
    flat = np.frombuffer(data, dtype, count, start)
    array = flat.reshape(shape, order="F" if fortran else "C")
    return array if array.flags.aligned else array.copy(order="K")


def _value(
    tree: Any,
    arrays: Mapping[str, NDArray[Any]],
    classes: Mapping[str, type],
    given: Mapping[str, object],
    depth: int,
) -> Any:
    if depth > _DEEPEST:
        raise ValueError("values are nested too deeply")
    if not isinstance(tree, list):
        if isinstance(tree, dict):
            raise ValueError("an unknown kind of value")
        return tree

    def inner(part: Any) -> Any:
        return _value(part, arrays, classes, given, depth + 1)

    kind, *parts = tree
    if kind == "given":
        return given[parts[0]]
    if kind == "array":
        return arrays[parts[0]]
    if kind == "scalar":
        return arrays[parts[0]][()]
    if kind in ("tuple", "list"):
        values = [inner(part) for part in parts]
        return tuple(values) if kind == "tuple" else values
    if kind == "dict":
        return {str(key): inner(part) for key, part in parts}
    if kind == "class":
        return classes[parts[0]](**{str(key): inner(part) for key, part in parts[1:]})
    raise ValueError("an unknown kind of value")
