"""Containers of glTF 2.0, read and written: JSON document, binary chunk, files beside it.

Source: glTF 2.0 specification, sections 3.6 (binary data), 4.4 (GLB layout), 2.8 (URIs).
"""

import base64
import binascii
import json
import os
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn
from urllib.parse import quote, unquote

from pygltflib import GLTF2, Buffer

from usdface.errors import InputError, OutputError
from usdface.io.asset_folder import OUTSIDE, is_inside, read_file
from usdface.io.atomic import all_or_none, staged_files, write_bridge, write_bytes
from usdface.io.gltf.decode import decode_document
from usdface.io.gltf.external_files import check_gltf_name
from usdface.io.gltf.user_data import UserData, user_data_of
from usdface.io.staging import finish_dead_runs

__all__ = ["GltfFile", "item", "load_document", "resource", "save_document"]

_MAX_BYTES = 2**32 - 1  # a GLB header has 32 bits for it (glTF 2.0, 4.4.2)
_MOST_OBJECTS = 2**18  # of the JSON: about 150 MB as pygltflib's
_JSON_CHUNK, _BIN_CHUNK = 0x4E4F534A, 0x004E4942  # glTF 2.0, 4.4.3
# Without these the file can still be read truly, or at worst looks plainer.
_DECODED = (
    *("KHR_animation_pointer", "KHR_mesh_quantization", "KHR_draco_mesh_compression"),
    *("EXT_meshopt_compression", "KHR_meshopt_compression", "EXT_mesh_gpu_instancing"),
)
_APPEARANCE = ("KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_")


@dataclass(frozen=True, eq=False, slots=True)
class GltfFile:
    """A parsed document with its buffers.

    Attributes
    ----------
    document : pygltflib.GLTF2
    node_weights : tuple, one for each node
        ``node.weights`` as in the JSON, None where absent; pygltflib's nodes lack it.
    buffers : tuple of bytes
    folder : Path
        Folder of relative URIs.
    asset_root : Path or None
        A folder above that they may also lead into.
    user_data : tuple of UserData
        All ``extensions`` and ``extras`` of the JSON, those that pygltflib lacks too.
    """

    document: GLTF2
    node_weights: tuple[Any, ...]
    buffers: tuple[bytes, ...]
    folder: Path
    asset_root: Path | None = None
    user_data: tuple[UserData, ...] = ()


def item(items: Sequence[Any], index: object, subject: str) -> Any:
    """Return `items[index]`, for an index that came from a file.

    Raises
    ------
    InputError
        If there is no such item.
    """
    if not isinstance(index, int) or not 0 <= index < len(items) or items[index] is None:
        raise InputError(
            f"there is no {subject} {index!r}; the file has {len(items)}", "SCHEMA_BROKEN"
        )
    return items[index]


def load_document(path: Path, asset_root: Path | None = None) -> GltfFile:
    """Read a .glb or .gltf with its buffers; which of the two it is, its first bytes tell.

    Files beside it come from its own folder, or from `asset_root`.

    Raises
    ------
    InputError
        If the file or a buffer is missing, empty, truncated, not glTF 2.0, reaches outside its
        folder, or requires an extension that is not decoded here.
    """
    finish_dead_runs(path.parent)
    try:
        if not path.is_file() and path.exists():  # a pipe or device may never end
            raise InputError("is no regular file", "FILE_UNREADABLE")
        if path.stat().st_size > _MAX_BYTES:
            raise InputError(
                "the file is larger than 4 GiB, the most that GLB can hold", "TOO_LARGE"
            )
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror or error}", "FILE_UNREADABLE") from error
    if not data:
        raise InputError("the file is empty", "FILE_UNREADABLE")
    text, chunk = _split_glb(data) if data[:4] == b"glTF" else (data, None)
    document, node_weights, user_data = _parse(text)
    _check_extensions(document)
    folder = path.parent
    buffers = tuple(
        _buffer_bytes(buffer, chunk if index == 0 else None, index, folder, asset_root)
        for index, buffer in enumerate(document.buffers or [])
    )
    return GltfFile(document, node_weights, buffers, folder, asset_root, user_data)


def _split_glb(data: bytes) -> tuple[bytes, bytes | None]:
    if len(data) < 20:
        raise InputError(f"the GLB header is cut off after {len(data)} bytes", "FILE_CUT_OFF")
    version, length = struct.unpack_from("<II", data, 4)
    if version != 2:
        raise InputError(f"this is GLB version {version}; expected 2", "FILE_UNREADABLE")
    if length > len(data):
        raise InputError(
            f"the GLB is cut off: its header says {length} bytes, it has {len(data)}",
            "FILE_CUT_OFF",
        )
    chunks: list[tuple[int, bytes]] = []
    offset = 12
    while offset + 8 <= length:
        size, kind = struct.unpack_from("<II", data, offset)
        if offset + 8 + size > length:
            raise InputError(f"the GLB chunk at byte {offset} is cut off", "FILE_CUT_OFF")
        chunks.append((kind, data[offset + 8 : offset + 8 + size]))
        offset += 8 + size
    if not chunks or chunks[0][0] != _JSON_CHUNK:
        raise InputError("the first chunk of the GLB is not JSON", "SCHEMA_BROKEN")
    binary = chunks[1][1] if len(chunks) > 1 and chunks[1][0] == _BIN_CHUNK else None
    return chunks[0][1], binary


def _parse(data: bytes) -> tuple[GLTF2, tuple[Any, ...], tuple[UserData, ...]]:
    if data.count(b"{") > _MOST_OBJECTS:
        raise InputError(f"the JSON has more than {_MOST_OBJECTS} objects", "TOO_LARGE")
    try:
        text = data.decode("utf-8-sig")
        raw = json.loads(text, parse_constant=_refuse_constant)
        document = decode_document(json.loads(text, object_hook=_plain_extras))
        node_weights = tuple(node.get("weights") for node in raw.get("nodes") or [])
        user_data = user_data_of(raw)
    except UnicodeDecodeError as error:
        raise InputError("the file is neither GLB nor UTF-8 text", "FILE_UNREADABLE") from error
    except json.JSONDecodeError as error:
        raise InputError(
            f"not glTF, or its JSON is malformed: {error}; export it again as .glb or .gltf",
            "FILE_UNREADABLE",
        ) from error
    except (AttributeError, KeyError, TypeError, ValueError, OverflowError) as error:
        raise InputError(
            f"the JSON does not follow the glTF schema: {error}", "SCHEMA_BROKEN"
        ) from error
    except RecursionError as error:
        raise InputError("the JSON is nested too deeply", "SCHEMA_BROKEN") from error
    version = getattr(document.asset, "version", None)
    if not isinstance(version, str) or not version.startswith("2."):
        raise InputError(f"asset.version is {version!r}; expected '2.0'", "FILE_UNREADABLE")
    return document, node_weights, user_data


def _refuse_constant(word: str) -> NoReturn:
    raise ValueError(f"{word} is not a JSON number")


def _plain_extras(values: dict[str, Any]) -> dict[str, Any]:
    # glTF allows any value as extras, pygltflib only an object.
    if not isinstance(values.get("extras", {}), dict):
        del values["extras"]
    return values


def _check_extensions(document: GLTF2) -> None:
    for name in document.extensionsRequired or []:
        if name not in _DECODED and not str(name).startswith(_APPEARANCE):
            raise InputError(
                f"the file requires the extension {name}, which usdface does not decode; "
                "export it without",
                "EXTENSION_UNSUPPORTED",
            )


def _buffer_bytes(
    buffer: Buffer | None, chunk: bytes | None, index: int, folder: Path, asset_root: Path | None
) -> bytes:
    if buffer is None or not isinstance(buffer.byteLength, int) or buffer.byteLength < 0:
        raise InputError(f"buffer {index} has no valid byteLength", "SCHEMA_BROKEN")
    if buffer.uri is not None:
        data = resource(buffer.uri, folder, asset_root)
    elif chunk is not None:
        data = chunk
    elif buffer.extensions:  # the fallback of a compression extension: never read
        data = b""
    else:
        raise InputError(f"buffer {index} has neither a URI nor a binary chunk", "SCHEMA_BROKEN")
    if len(data) < buffer.byteLength and not (buffer.extensions and not data):
        raise InputError(
            f"buffer {index} is cut off: it should have {buffer.byteLength} bytes, has {len(data)}",
            "FILE_CUT_OFF",
        )
    return data[: buffer.byteLength]


def resource(uri: str, folder: Path, asset_root: Path | None) -> bytes:
    """Return the bytes behind a URI: base64 data, or a file inside `folder` or `asset_root`.

    Raises
    ------
    InputError
        If it is absolute, leaves the folder, names a scheme, or cannot be read.
    """
    if uri.startswith("data:"):
        header, _, body = uri.partition(",")
        if not header.endswith(";base64"):
            raise InputError("a data URI is not base64", "SCHEMA_BROKEN")
        try:
            return base64.b64decode(body, validate=True)
        except (binascii.Error, ValueError) as error:
            raise InputError(f"a data URI is malformed: {error}", "SCHEMA_BROKEN") from error
    name = unquote(uri)
    foreign = ":" in name.split("/")[0] or "\\" in name
    if foreign or not is_inside(folder / name, (folder, asset_root)):
        raise InputError(f"the URI {uri!r} {OUTSIDE}", "URI_OUTSIDE")
    return read_file(folder / name, _MAX_BYTES)


def save_document(
    document: GLTF2, blob: Sequence[bytes], beside: Mapping[str, bytes], path: Path
) -> None:
    """Write a document as GLB, or as .gltf with a .bin and the files `beside` it, by suffix.

    `blob` are the parts of the buffer, in order. Names in `beside` are relative to the folder of
    `path`.

    All of them are written or none, the .gltf last. Equal input gives equal bytes.

    Raises
    ------
    OutputError
        If the suffix is neither, the data are too large, or a file cannot be written.
    """
    check_gltf_name(path)
    binary = path.suffix.lower() == ".glb"
    size = sum(map(len, blob))
    blob = [*blob, bytes(-size % 4)]
    size += -size % 4
    name = f"{path.stem}.bin"
    if size:
        document.buffers = [Buffer(byteLength=size, uri=None if binary else quote(name))]
    layout: dict[str, Any] = (
        {"separators": (",", ":")} if binary else {"indent": 1, "ensure_ascii": False}
    )
    try:
        text = document.to_json(allow_nan=False, **layout).encode("utf-8", "replace")
    except ValueError as error:
        raise OutputError(
            f"cannot write {path}: a number of the scene is not finite ({error})"
        ) from error
    if not binary:
        with all_or_none():
            if size:
                write_bytes(path.with_name(name), *blob)
            for file, data in beside.items():
                write_bytes(path.parent / file, data)
            write_bytes(path, text)
            if _name_staged(document, path):
                with write_bridge(path) as bridge:
                    bridge.write_bytes(document.to_json(allow_nan=False, **layout).encode())
        return
    text += b" " * (-len(text) % 4)
    chunks = [struct.pack("<II", len(text), _JSON_CHUNK), text]
    if size:
        chunks += [struct.pack("<II", size, _BIN_CHUNK), *blob]
    length = 12 + sum(map(len, chunks))
    if length > _MAX_BYTES:
        raise OutputError(f"cannot write {path}: a GLB holds at most 4 GiB; use .gltf")
    write_bytes(path, struct.pack("<4sII", b"glTF", 2, length), *chunks)


def _name_staged(document: GLTF2, path: Path) -> bool:
    """Let the document name staged files where they lie; return whether it names any."""
    staged, found = staged_files(), False
    for named in (*(document.buffers or ()), *(document.images or ())):
        place = staged.get(path.parent / unquote(named.uri)) if named.uri else None
        if place is not None:
            named.uri = quote(Path(os.path.relpath(place, path.parent)).as_posix())
            found = True
    return found
