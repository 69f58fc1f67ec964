"""JSON and accessors of a glTF file, read with json, struct and numpy alone.

Source: glTF 2.0 specification, sections 3.6.2 (accessors), 4.4 (GLB layout).
"""

import base64
import json
import struct
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from usdface.errors import InputError
from usdface.io.asset_folder import OUTSIDE, is_inside, read_file
from usdface.io.gltf.decompress import decompress
from usdface.io.gltf.document import load_document

__all__ = ["PlayerFile"]

# By componentType and by type: glTF 2.0, 3.6.2.2.
_DTYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
_MAX_BYTES = 2**32 - 1
_MOST_NUMBERS = 2**28  # in the morph targets of one file
_COMPRESSED = {
    *("EXT_meshopt_compression", "KHR_meshopt_compression"),
    "KHR_draco_mesh_compression",
}
_KNOWN = {"KHR_animation_pointer", "KHR_mesh_quantization", "EXT_mesh_gpu_instancing"}


class PlayerFile:
    """JSON and buffers of one file.

    `decoded` tells whether it was compressed; then our own decoder made it plain.
    """

    def __init__(self, path: Path, asset_root: Path | None = None) -> None:
        data = path.read_bytes()
        chunk: memoryview | None = None
        if data[:4] == b"glTF":
            size = struct.unpack_from("<I", data, 12)[0]
            text, chunk = data[20 : 20 + size], memoryview(data)[28 + size :]
        else:
            text = data
        self.json: dict[str, Any] = json.loads(text)
        listed = {*self.json.get("extensionsRequired", []), *self.json.get("extensionsUsed", [])}
        self.decoded = bool(_COMPRESSED & listed)
        if unknown := set(self.json.get("extensionsRequired", [])) - _KNOWN - _COMPRESSED:
            raise InputError(f"{path} cannot be evaluated: it needs {', '.join(sorted(unknown))}")
        if self.decoded:
            self.buffers = self._decoded(path, asset_root)
        else:
            buffers = self.json.get("buffers", [])
            self.buffers = [self._buffer(buffer, path, chunk, asset_root) for buffer in buffers]
        self.budget = _MOST_NUMBERS

    def _decoded(self, path: Path, asset_root: Path | None) -> list[memoryview]:
        """Use the decoder of the reader for compressed data: there is no second one."""
        stored_as = load_document(path, asset_root)
        plain = decompress(stored_as)
        self.decoded = plain is not stored_as
        stored = json.loads(plain.document.to_json())
        for name in ("accessors", "bufferViews", "meshes"):
            self.json[name] = stored[name]
        return [memoryview(data) for data in plain.buffers]

    @staticmethod
    def _buffer(
        buffer: dict[str, Any], path: Path, chunk: memoryview | None, asset_root: Path | None
    ) -> memoryview:
        uri = buffer.get("uri")
        if uri is None:
            return memoryview(b"") if chunk is None else chunk
        if uri.startswith("data:"):
            return memoryview(base64.b64decode(uri.partition(",")[2]))
        beside = path.parent / unquote(uri)
        if not is_inside(beside, (path.parent, asset_root)):
            raise ValueError(f"{uri} {OUTSIDE}")
        return memoryview(read_file(beside, _MAX_BYTES))

    def _rows(self, view: int, offset: int, dtype: str, shape: tuple[int, int]) -> NDArray[Any]:
        v = self.json["bufferViews"][view]
        size = np.dtype(dtype).itemsize
        start, stride = v.get("byteOffset", 0), v.get("byteStride") or shape[1] * size
        data = self.buffers[v["buffer"]][start : start + v["byteLength"]]
        return np.ndarray(shape, dtype, data, offset, (stride, size))

    def half_step(self, index: int) -> float:
        """Return half the distance of two numbers that an accessor can have; 0 for floats."""
        a = self.json["accessors"][index]
        kind = np.dtype(_DTYPES[a["componentType"]])
        if kind.kind == "f":
            return 0.0
        return 0.5 / float(np.iinfo(kind).max) if a.get("normalized") else 0.5

    def accessor(self, index: int) -> NDArray[Any]:
        """Return an accessor as (count, width), normalised integers as their values."""
        a = self.json["accessors"][index]
        dtype, shape = _DTYPES[a["componentType"]], (a["count"], _WIDTHS[a["type"]])
        self.budget -= shape[0] * shape[1]
        if self.budget < 0:
            raise ValueError("it unfolds into too many numbers")
        values = np.zeros(shape, dtype)
        if "bufferView" in a:
            values[:] = self._rows(a["bufferView"], a.get("byteOffset", 0), dtype, shape)
        if "sparse" in a:
            s, count = a["sparse"], a["sparse"]["count"]
            where, value_view = s["indices"], s["values"]
            kind = _DTYPES[where["componentType"]]
            place = self._rows(where["bufferView"], where.get("byteOffset", 0), kind, (count, 1))
            values[place[:, 0]] = self._rows(
                value_view["bufferView"], value_view.get("byteOffset", 0), dtype, (count, shape[1])
            )
        if a.get("normalized") and dtype != "<f4":
            return np.maximum(values / np.float64(np.iinfo(dtype).max), -1.0)
        return values
