"""Accessors of glTF as numpy arrays.

Source: glTF 2.0 specification, section 3.6.2 (accessors, sparse accessors, alignment) and
the extension KHR_mesh_quantization.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pygltflib import Accessor

from usdface.arrays import FloatArray, IntArray
from usdface.errors import InputError
from usdface.io.gltf.document import GltfFile, item

__all__ = ["DTYPES", "WIDTHS", "AccessorReader"]

# By componentType and by type: glTF 2.0, 3.6.2.2.
DTYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


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

    def stored(self, index: object) -> int:
        """Return how many elements of accessor `index` the file holds: zeros take no bytes."""
        count = self.count(index)
        accessor = item(self.file.document.accessors or [], index, "accessor")
        if accessor.bufferView is not None:
            return count
        given = accessor.sparse.count if accessor.sparse is not None else 0
        return given if isinstance(given, int) else 0

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
            values = np.zeros((count, WIDTHS[kind]), dtype)
        else:
            values = self._elements(
                accessor.bufferView, accessor.byteOffset, count, dtype, WIDTHS[kind], index
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
        if accessor.componentType not in DTYPES:
            raise InputError(
                f"accessor {index} has component type {accessor.componentType!r}", "ACCESSOR_WRONG"
            )
        return np.dtype(DTYPES[accessor.componentType])

    def _sparse(
        self, accessor: Accessor, index: object, kind: str
    ) -> tuple[IntArray, NDArray[Any]]:
        dtype = self._dtype(accessor, index, kind)
        sparse, width = accessor.sparse, WIDTHS[kind]
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
        index_type = np.dtype(DTYPES[places.componentType])
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
