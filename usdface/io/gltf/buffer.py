"""The buffer of a glTF that is being written, its views and accessors.

Source: glTF 2.0 specification, section 3.6.2 (accessors, sparse accessors, alignment) and
the extension KHR_mesh_quantization.
"""

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

from usdface.arrays import FloatArray, IntArray
from usdface.errors import OutputError
from usdface.io.gltf.accessors import DTYPES, WIDTHS

__all__ = ["BufferBuilder"]

_COMPONENTS = {np.dtype(dtype): code for code, dtype in DTYPES.items()}
_KINDS = {width: kind for kind, width in WIDTHS.items()}
Short = Literal["signed", "unsigned"]


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
    def blob(self) -> tuple[bytes, ...]:
        """All bytes so far, in parts."""
        return tuple(self._parts)

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
