"""Decompression of glTF on loading: meshopt buffer views and Draco primitives.

Both need a library of the extra ``compression``. Decoded data take at most 1,024 times the bytes
they came from, which is the densest code of meshopt, and a gigabyte.

Source: EXT_meshopt_compression, KHR_meshopt_compression, KHR_draco_mesh_compression.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pygltflib import Buffer, BufferView

from usdface.errors import InputError, how_to_install
from usdface.io.gltf.accessors import DTYPES
from usdface.io.gltf.document import GltfFile, item
from usdface.io.gltf.draco import decode_draco

__all__ = ["decompress"]

_MESHOPT = ("EXT_meshopt_compression", "KHR_meshopt_compression")
_DRACO = "KHR_draco_mesh_compression"
_LIBRARIES = dict.fromkeys(_MESHOPT, "meshoptimizer") | {_DRACO: "DracoPy"}
_DENSEST = 1024  # bytes from one: EXT_meshopt_compression, bitstream of runs of zeros
_MOST_BYTES = 2**30  # decoded; a bound on memory that a small file may ask for
# Strides that a filter allows: EXT_meshopt_compression, "Filters".
_FILTERS = {"OCTAHEDRAL": (4, 8), "QUATERNION": (8,), "EXPONENTIAL": tuple(range(4, 257, 4))}


def decompress(file: GltfFile) -> GltfFile:
    """Return the file with its compression undone; itself where there is none to undo.

    Where the file holds the plain data, too, they are used: many programs list an extension as
    used, not as required, and leave them out nevertheless.

    Raises
    ------
    InputError
        If a library is missing, or compressed data are damaged or larger than allowed.
    """
    listed = set(file.document.extensionsRequired or []) & set(_LIBRARIES)
    required = sorted(listed | _without_plain_data(file))
    for name in required:
        if find_spec(_LIBRARIES[name]) is None:
            raise InputError(
                f"the file needs {name}; install {_LIBRARIES[name]} "
                f"({how_to_install('compression')})",
                "EXTENSION_UNSUPPORTED",
            )
    if not required:
        return file
    plain = _DecodedBuffer(file)
    if set(required) & set(_MESHOPT):
        _undo_meshopt(file, plain)
        file = plain.file()
    if _DRACO in required:
        _undo_draco(file, plain)
    return plain.file()


def _without_plain_data(file: GltfFile) -> set[str]:
    """Return the extensions of which some data are there in no other form."""
    document, found = file.document, set()
    for view in document.bufferViews or []:
        named = set(_MESHOPT) & set((view.extensions if view else None) or {})
        held = file.buffers[view.buffer] if named and _is_index(view.buffer, file.buffers) else b""
        if len(held) < (view.byteOffset or 0) + (view.byteLength or 0) and named:
            found |= named
    for primitive in (p for mesh in document.meshes or [] for p in mesh.primitives or []):
        code = (primitive.extensions or {}).get(_DRACO)
        stored = _accessors(file, primitive, code).values() if code is not None else ()
        if any(accessor.bufferView is None and accessor.sparse is None for accessor in stored):
            found.add(_DRACO)
    return found


def _is_index(value: object, items: Sequence[object]) -> bool:
    return isinstance(value, int) and 0 <= value < len(items)


class _DecodedBuffer:
    """The decoded data of a file, which become one more buffer."""

    def __init__(self, file: GltfFile) -> None:
        self._file = file
        self._parts: list[bytes] = []
        self._length = 0

    def add(self, data: bytes, stride: int | None = None) -> BufferView:
        """Return a bufferView of decoded bytes."""
        view = BufferView(
            buffer=len(self._file.buffers),
            byteOffset=self._length,
            byteLength=len(data),
            byteStride=stride,
        )
        self._parts.append(data + bytes(-len(data) % 4))
        self._length += len(self._parts[-1])
        if self._length > _MOST_BYTES:
            raise InputError("the decompressed data take more than 1 GiB", "TOO_LARGE")
        return view

    def file(self) -> GltfFile:
        """Return the file with the decoded data so far."""
        blob = b"".join(self._parts)
        if len(self._file.document.buffers) == len(self._file.buffers):
            self._file.document.buffers.append(Buffer())
        self._file.document.buffers[-1] = Buffer(byteLength=len(blob))
        return replace(self._file, buffers=(*self._file.buffers, blob))


def _slice(file: GltfFile, place: Mapping[str, Any], subject: str) -> bytes:
    data = item(file.buffers, place.get("buffer"), "buffer")
    start, length = place.get("byteOffset", 0), place.get("byteLength")
    sound = all(isinstance(n, int) and n >= 0 for n in (start, length))
    if not sound or start + length > len(data):
        raise InputError(f"{subject} reaches beyond its buffer")
    return bytes(data[start : start + length])


# -- meshopt -------------------------------------------------------------------------------


def _undo_meshopt(file: GltfFile, plain: _DecodedBuffer) -> None:
    views = file.document.bufferViews or []
    for index, view in enumerate(views):
        extensions = (view.extensions if view else None) or {}
        code = next((extensions[name] for name in _MESHOPT if name in extensions), None)
        if code is not None:
            where = f"meshopt data of bufferView {index}"
            stride = view.byteStride
            views[index] = plain.add(_meshopt(file, code, where), stride)


def _meshopt(file: GltfFile, code: Mapping[str, Any], where: str) -> bytes:
    from meshoptimizer import decoder

    data = _slice(file, code, where)
    count, stride, mode = code.get("count"), code.get("byteStride"), code.get("mode")
    sizes = {"ATTRIBUTES": range(4, 257, 4), "TRIANGLES": (2, 4), "INDICES": (2, 4)}
    if not isinstance(count, int) or count < 1 or mode not in sizes:
        raise InputError(f"{where} have mode {mode!r} and count {count!r}")
    if (
        not isinstance(stride, int)
        or stride not in sizes[mode]
        or (mode == "TRIANGLES" and count % 3)
    ):
        raise InputError(f"{where} have {count} elements of {stride!r} bytes; not so in {mode}")
    _check_size(count * stride, len(data), where)
    chosen = code.get("filter") or "NONE"
    if chosen != "NONE" and (mode != "ATTRIBUTES" or stride not in _FILTERS.get(chosen, ())):
        raise InputError(f"{where} have the filter {chosen!r}, which is not decoded")
    try:
        if mode == "ATTRIBUTES":
            made = decoder.decode_vertex_buffer(count, stride, data, np.dtype(f"V{stride}"))
        elif mode == "TRIANGLES":
            made = decoder.decode_index_buffer(count, stride, data)
        else:
            made = decoder.decode_index_sequence(count, stride, data)
        if chosen != "NONE":
            filters = {
                "OCTAHEDRAL": decoder.decode_filter_oct,
                "QUATERNION": decoder.decode_filter_quat,
                "EXPONENTIAL": decoder.decode_filter_exp,
            }
            made = filters[chosen](made, count, stride)
    except (RuntimeError, ValueError) as error:
        raise InputError(f"{where} are damaged: {error}") from error
    return bytes(made.tobytes()[: count * stride])


def _check_size(size: int, source: int, where: str) -> None:
    if size > min(_MOST_BYTES, _DENSEST * source):
        raise InputError(f"{where} would unfold from {source} bytes into {size}")


# -- Draco ---------------------------------------------------------------------------------


def _undo_draco(file: GltfFile, plain: _DecodedBuffer) -> None:
    document = file.document
    jobs: list[tuple[Any, Mapping[str, Any], str]] = []
    for number, mesh in enumerate(document.meshes or []):
        for primitive in mesh.primitives or []:
            code = (primitive.extensions or {}).get(_DRACO)
            if code is not None:
                jobs.append((primitive, code, f"Draco data of mesh {number}"))
    blobs = []
    for primitive, code, where in jobs:
        view = item(document.bufferViews or [], code.get("bufferView"), "bufferView")
        blobs.append(_slice(file, vars(view), where))
        for accessor in _accessors(file, primitive, code).values():
            _check_size((accessor.count or 0) * 16, len(blobs[-1]), where)
    for (primitive, code, where), made in zip(jobs, decode_draco(blobs), strict=True):
        if made is None:
            raise InputError(f"{where} are damaged")
        for name, accessor in _accessors(file, primitive, code).items():
            if name:
                values = made.get(str(code["attributes"][name]))
                _fill(accessor, values, plain, document, f"{name} in {where}")
            else:
                _fill(accessor, made["faces"].ravel(), plain, document, f"indices in {where}")


def _accessors(file: GltfFile, primitive: Any, code: Mapping[str, Any]) -> dict[str, Any]:
    """Return the accessors that Draco data fill by attribute; the indices as ""."""
    accessors = file.document.accessors or []
    names = {"": primitive.indices}
    for name in code.get("attributes") or {}:
        names[name] = getattr(primitive.attributes, name, None)
    return {name: item(accessors, index, "accessor") for name, index in names.items()}


def _fill(
    accessor: Any, values: NDArray[Any] | None, plain: _DecodedBuffer, document: Any, where: str
) -> None:
    dtype = DTYPES.get(accessor.componentType)
    count = None if values is None else len(values)
    if values is None or dtype is None or count != accessor.count:
        raise InputError(f"{where}: {count} elements; the file announces {accessor.count}")
    document.bufferViews.append(plain.add(np.ascontiguousarray(values.astype(dtype)).tobytes()))
    accessor.bufferView, accessor.byteOffset = len(document.bufferViews) - 1, 0
    accessor.sparse = None
