"""Accessors of glTF as numpy arrays, in and out.

Source: glTF 2.0 specification, section 3.6.2 (accessors, sparse accessors, alignment) and
the extension KHR_mesh_quantization.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pygltflib import (
    ARRAY_BUFFER,
    Accessor,
    AccessorSparseIndices,
    AccessorSparseValues,
    BufferView,
    Sparse,
)

from usdface.errors import InputError, OutputError
from usdface.io.gltf.document import GltfFile, item
from usdface.takes import FloatArray, IntArray

__all__ = ["AccessorReader", "BufferBuilder"]

_DTYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_COMPONENTS = {np.dtype(dtype): code for code, dtype in _DTYPES.items()}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
Short = Literal["signed", "unsigned"]
_KINDS = {width: kind for kind, width in _WIDTHS.items()}


@dataclass(frozen=True, eq=False, slots=True)
class AccessorReader:
    """Reads the accessors of one file; every bound is checked before anything is allocated."""

    file: GltfFile

    def count(self, index: object) -> int:
        """Return how many elements accessor `index` announces."""
        count = item(self.file.document.accessors or [], index, "accessor").count
        if not isinstance(count, int) or count < 1:
            raise InputError(
                f"accessor {index} has count {count!r}; expected at least 1", "ACCESSOR_WRONG"
            )
        return count

    def kind(self, index: object, kinds: Sequence[str]) -> str:
        """Return which of `kinds` accessor `index` is; the first where it is None or none."""
        if index is None:
            return kinds[0]
        given = item(self.file.document.accessors or [], index, "accessor").type
        return given if given in kinds else kinds[0]

    def floats(self, index: object, kind: str) -> FloatArray:
        """Return an accessor as (count, width) float64, normalised integers as their values.

        Raises
        ------
        InputError
            If it is not of this `kind` ("SCALAR", "VEC3", ...), reaches beyond its data,
            or holds NaN or infinity.
        """
        return self._dequantised(index, self._dense(index, kind))

    def integers(self, index: object, kind: str) -> IntArray:
        """Return an accessor of integers as (count, width) int64."""
        raw = self._dense(index, kind)
        if raw.dtype.kind == "f":
            raise InputError(f"accessor {index} holds floats; expected integers", "ACCESSOR_WRONG")
        return raw.astype(np.int64)

    def offsets(self, index: object, count: int) -> tuple[IntArray, FloatArray]:
        """Return the rows of a VEC3 morph target that are not zero: (N,) and (N, 3).

        Raises
        ------
        InputError
            As `floats`, or if it does not have `count` elements.
        """
        if self.count(index) != count:
            raise InputError(
                f"morph target accessor {index} has {self.count(index)} elements "
                f"for {count} vertices",
                "TARGETS_UNEQUAL",
            )
        accessor = item(self.file.document.accessors, index, "accessor")
        if accessor.bufferView is None:  # zeros need no memory
            indices, raw = self._sparse(accessor, index, "VEC3")
        else:
            raw = self._dense(index, "VEC3")
            indices = np.arange(count)
        values = self._dequantised(index, raw)
        moved = values.any(axis=1)
        return indices[moved], values[moved]

    def _dequantised(self, index: object, raw: NDArray[Any]) -> FloatArray:
        accessor = self.file.document.accessors[index]
        if not np.isfinite(raw).all():
            raise InputError(f"accessor {index} holds NaN or infinite numbers", "VALUES_WRONG")
        values = raw.astype(np.float64)
        if accessor.normalized and raw.dtype.kind != "f":
            values = np.maximum(values / np.iinfo(raw.dtype).max, -1.0)
        return values

    def _dense(self, index: object, kind: str) -> NDArray[Any]:
        count = self.count(index)
        accessor = item(self.file.document.accessors, index, "accessor")
        dtype = self._dtype(accessor, index, kind)
        if accessor.bufferView is None:
            held = sum(map(len, self.file.buffers))
            if count > held:
                raise InputError(
                    f"accessor {index} announces {count} elements, but the whole file holds "
                    f"only {held} bytes",
                    "TOO_LARGE",
                )
            values = np.zeros((count, _WIDTHS[kind]), dtype)
        else:
            values = self._elements(
                accessor.bufferView, accessor.byteOffset, count, dtype, _WIDTHS[kind], index
            )
        if accessor.sparse is not None:
            indices, replacing = self._sparse(accessor, index, kind)
            values = values.copy()
            values[indices] = replacing
        return values

    def _dtype(self, accessor: Accessor, index: object, kind: str) -> np.dtype[Any]:
        if accessor.type != kind:
            raise InputError(
                f"accessor {index} is of type {accessor.type!r}; expected {kind}", "ACCESSOR_WRONG"
            )
        if accessor.componentType not in _DTYPES:
            raise InputError(
                f"accessor {index} has component type {accessor.componentType!r}", "ACCESSOR_WRONG"
            )
        return np.dtype(_DTYPES[accessor.componentType])

    def _sparse(
        self, accessor: Accessor, index: object, kind: str
    ) -> tuple[IntArray, NDArray[Any]]:
        dtype = self._dtype(accessor, index, kind)
        sparse, width = accessor.sparse, _WIDTHS[kind]
        if sparse is None:
            return np.zeros(0, np.int64), np.zeros((0, width), dtype)
        count, places, values = sparse.count, sparse.indices, sparse.values
        if not isinstance(count, int) or not 0 < count <= accessor.count:
            raise InputError(
                f"sparse accessor {index} has count {count!r} of {accessor.count}", "ACCESSOR_WRONG"
            )
        if places is None or values is None or places.componentType not in (5121, 5123, 5125):
            raise InputError(
                f"sparse accessor {index} has no valid indices and values", "ACCESSOR_WRONG"
            )
        index_type = np.dtype(_DTYPES[places.componentType])
        rows = self._elements(places.bufferView, places.byteOffset, count, index_type, 1, index)
        indices = rows[:, 0].astype(np.int64)
        if (np.diff(indices) <= 0).any() or indices[-1] >= accessor.count:
            raise InputError(
                f"the indices of sparse accessor {index} must increase and stay below "
                f"{accessor.count}",
                "ACCESSOR_WRONG",
            )
        return indices, self._elements(
            values.bufferView, values.byteOffset, count, dtype, width, index
        )

    def _elements(
        self,
        view_index: object,
        offset: int | None,
        count: int,
        dtype: np.dtype[Any],
        width: int,
        index: object,
    ) -> NDArray[Any]:
        view = item(self.file.document.bufferViews or [], view_index, "bufferView")
        data = item(self.file.buffers, view.buffer, "buffer")
        start, length = view.byteOffset or 0, view.byteLength or 0
        if start < 0 or length < 0 or start + length > len(data):
            raise InputError(f"bufferView {view_index} reaches beyond its buffer", "ACCESSOR_WRONG")
        size = dtype.itemsize * width
        stride = view.byteStride or size
        offset = offset or 0
        if stride < size or offset < 0 or offset + (count - 1) * stride + size > length:
            raise InputError(
                f"accessor {index} reaches beyond its bufferView {view_index}", "ACCESSOR_WRONG"
            )
        return np.ndarray(
            (count, width), dtype, data, start + offset, strides=(stride, dtype.itemsize)
        )


class BufferBuilder:
    """The one buffer of a file that is being written: accessors go in, indices come out.

    Parameters
    ----------
    shorts : bool
        Store vertex attributes that allow it as normalised 16-bit integers
        (KHR_mesh_quantization) where their numbers lie within them.
    """

    def __init__(self, shorts: bool = False) -> None:
        self.shorts = shorts
        self.views: list[BufferView] = []
        self.accessors: list[Accessor] = []
        self._parts: list[bytes] = []
        self._length = 0

    @property
    def blob(self) -> bytes:
        """All bytes so far."""
        return b"".join(self._parts)

    def view(self, data: bytes, target: int | None = None, stride: int | None = None) -> int:
        """Append bytes, aligned to 4; return the index of their bufferView."""
        size, start = len(data), self._length
        self.views.append(
            BufferView(
                buffer=0, byteOffset=start, byteLength=size, byteStride=stride, target=target
            )
        )
        padded = data + bytes(-len(data) % 4)
        self._parts.append(padded)
        self._length += len(padded)
        return len(self.views) - 1

    def array(
        self,
        values: NDArray[Any],
        target: int | None = None,
        *,
        bounds: bool = False,
        short: Short | None = None,
    ) -> int:
        """Append (count, width) integers or floats (as float32); return the accessor's index.

        `short` tells which 16-bit integers the attribute may be stored as.

        Raises
        ------
        OutputError
            If a number does not fit float32.
        """
        values = _storable(values)
        if self.shorts and short and _fits(values, short):
            values = _shortened(values, short)
        limits = (values.min(axis=0), values.max(axis=0)) if bounds else None
        if values.dtype.kind != "f" and short:
            view = self._strided(values)
            return self._accessor(values.dtype, values.shape, limits, view, normalized=True)
        return self._accessor(values.dtype, values.shape, limits, self.view(_bytes(values), target))

    def offsets(self, indices: IntArray, values: FloatArray, count: int) -> int:
        """Append a VEC3 morph target that is zero but for some rows; return its accessor.

        It is sparse where that is smaller, and takes no bytes where nothing moves. Bounds
        are always given (the specification wants them for POSITION).

        Parameters
        ----------
        indices : (N,) int64, increasing
        values : (N, 3) float64
        count : int
            Vertices.
        """
        values = _storable(values)
        if self.shorts and _fits(values, "signed"):
            values = _shortened(values, "signed")
        limits = (np.zeros(3, values.dtype), np.zeros(3, values.dtype))
        if len(values):
            limits = (values.min(axis=0), values.max(axis=0))
            if len(values) < count:
                limits = (np.minimum(limits[0], 0), np.maximum(limits[1], 0))
        index_type = np.dtype("<u2" if count <= 2**16 - 1 else "<u4")
        shape = (count, 3)
        if not len(values):
            return self._accessor(np.dtype("<f4"), shape, limits, None)
        whole_numbers = values.dtype.kind != "f"
        size = 3 * values.itemsize
        whole = -(-size // 4) * 4  # of a vertex, which must start at a multiple of 4
        if len(values) * (size + index_type.itemsize) >= count * whole:
            dense = np.zeros(shape, values.dtype)
            dense[indices] = values
            view = self._strided(dense)
            return self._accessor(dense.dtype, shape, limits, view, normalized=whole_numbers)
        sparse = Sparse(
            count=len(values),
            indices=AccessorSparseIndices(
                bufferView=self.view(_bytes(indices.astype(index_type))),
                componentType=_COMPONENTS[index_type],
            ),
            values=AccessorSparseValues(bufferView=self.view(_bytes(values))),
        )
        return self._accessor(values.dtype, shape, limits, None, sparse, normalized=whole_numbers)

    def _strided(self, values: NDArray[Any]) -> int:
        """Append vertex attributes so that each starts at a multiple of 4 bytes."""
        spare = -values.shape[1] * values.itemsize % 4 // values.itemsize
        if not spare:
            return self.view(_bytes(values), ARRAY_BUFFER)
        wide = np.pad(values, ((0, 0), (0, spare)))
        return self.view(_bytes(wide), ARRAY_BUFFER, wide.shape[1] * wide.itemsize)

    def zeros(self, count: int, width: int) -> int:
        """Append an accessor of zeros that takes no bytes."""
        return self._accessor(np.dtype("<f4"), (count, width), None, None)

    def _accessor(
        self,
        dtype: np.dtype[Any],
        shape: tuple[int, ...],
        limits: tuple[NDArray[Any], NDArray[Any]] | None,
        view: int | None,
        sparse: Sparse | None = None,
        *,
        normalized: bool = False,
    ) -> int:
        low, high = limits or (np.empty(0), np.empty(0))
        self.accessors.append(
            Accessor(
                bufferView=view,
                # The specification forbids an offset without a view.
                byteOffset=None if view is None else 0,
                componentType=_COMPONENTS[dtype],
                normalized=normalized or None,
                count=shape[0],
                type=_KINDS[shape[1]],
                min=low.tolist(),
                max=high.tolist(),
                sparse=sparse,
            )
        )
        return len(self.accessors) - 1


def _fits(values: NDArray[Any], short: Short) -> bool:
    low = 0.0 if short == "unsigned" else -1.0
    return values.size == 0 or bool(low <= values.min() and values.max() <= 1.0)


def _shortened(values: NDArray[Any], short: Short) -> NDArray[Any]:
    """Return numbers within [-1, 1] or [0, 1] as the nearest normalised 16-bit integers."""
    dtype = np.dtype("<u2" if short == "unsigned" else "<i2")
    return np.round(values.astype(np.float64) * np.iinfo(dtype).max).astype(dtype)


def _storable(values: ArrayLike) -> NDArray[Any]:
    array = np.asarray(values)
    if array.dtype.kind != "f":
        return array
    with np.errstate(over="ignore"):
        array = array.astype("<f4") + np.float32(0)  # no negative zeros
    if not np.isfinite(array).all():
        raise OutputError("a number is too large for glTF's 32-bit floats")
    return array


def _bytes(values: NDArray[Any]) -> bytes:
    return np.ascontiguousarray(values).tobytes()
