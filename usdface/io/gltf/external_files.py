"""The files that a glTF names, without reading more of it than its JSON.

Source: glTF 2.0 specification, sections 2.8 (URIs) and 4.4 (GLB layout).
"""

import json
import struct
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from usdface.errors import OutputError

__all__ = ["check_gltf_name", "external_files", "generator_of", "may_be_gltf", "metadata_of"]

_HEADER = 20  # bytes: that of the file, and length and type of the first chunk
_LARGEST = 2**32  # bytes
_LARGEST_TEXT = 2**26  # bytes of a .gltf whose metadata are searched


def may_be_gltf(path: Path) -> bool:
    """Return whether a file begins as GLB or as JSON, whatever its name."""
    try:
        if not path.is_file():
            return False
        with path.open("rb") as file:
            begin = file.read(64)
    except (OSError, ValueError):
        return False
    return begin.startswith(b"glTF") or begin.removeprefix(b"\xef\xbb\xbf").lstrip()[:1] == b"{"


def external_files(path: Path) -> list[Path]:
    """Return the buffers and images that a .glb or .gltf refers to and that lie in its folder.

    An unreadable file names none; its reader reports the fault.
    """
    try:
        document = json.loads(_text(path))
    except (OSError, ValueError, RecursionError, struct.error):
        return []
    lists = [document.get(key) for key in ("buffers", "images")] if _is_object(document) else []
    entries = [e for found in lists if isinstance(found, list) for e in found if _is_object(e)]
    uris = [uri for e in entries if isinstance(uri := e.get("uri"), str)]
    places = [_place(path.parent, uri) for uri in uris if not uri.startswith("data:")]
    return list(dict.fromkeys(place for place in places if place))


def check_gltf_name(path: Path) -> None:
    """Refuse to write glTF under another name, before any work.

    Raises
    ------
    OutputError
        If it does not end in .glb or .gltf.
    """
    if path.suffix.lower() not in (".glb", ".gltf"):
        raise OutputError(f"cannot write {path}: a glTF file ends in .glb or .gltf")


def metadata_of(path: Path) -> dict[str, Any]:
    """Return the metadata of conversions in the extras of a file's asset; {} where it has none."""
    document: Any = _asset(path)
    for key in ("extras", "usdface"):
        document = document.get(key) if _is_object(document) else None
    return document if isinstance(document, dict) else {}


def generator_of(path: Path) -> str:
    """Return the name of the program that wrote a file; "" where it names none."""
    return str(_asset(path).get("generator", ""))


def _asset(path: Path) -> dict[str, Any]:
    """Return the asset of a file; {} where it has none, or is no glTF that can be read."""
    try:
        if path.stat().st_size > _LARGEST_TEXT and not _is_binary(path):
            return {}
        document = json.loads(_text(path))
    except (OSError, ValueError, RecursionError, struct.error):
        return {}
    asset = document.get("asset") if _is_object(document) else None
    return asset if isinstance(asset, dict) else {}


def _is_binary(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(4) == b"glTF"


def _text(path: Path) -> bytes:
    if path.stat().st_size > _LARGEST:
        raise ValueError("larger than glTF can be")
    with path.open("rb") as file:
        begin = file.read(_HEADER)
        if not begin.startswith(b"glTF"):
            return begin + file.read()
        return file.read(min(struct.unpack_from("<I", begin, 12)[0], path.stat().st_size))


def _is_object(value: Any) -> bool:
    return isinstance(value, dict)


def _place(folder: Path, uri: str) -> Path | None:
    """Return the file behind a URI; None outside `folder`, which is never read."""
    try:
        place = folder / unquote(uri)
        inside = place.resolve().is_relative_to(folder.resolve())
        return place if inside and place.is_file() else None
    except (OSError, ValueError):
        return None
