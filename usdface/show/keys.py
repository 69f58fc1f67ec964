"""Keys of results: SHA-256 over the content of all that a result depends on.

That is the bytes of each file that is read, the files that are named but not there, the options,
and the program: this package's own files, Python, and the libraries that compute or read.
"""

import hashlib
import json
import os
import platform
import re
import time
from collections.abc import Iterable, Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, entry_points, version
from importlib.util import find_spec
from pathlib import Path
from typing import Any

__all__ = ["content_key", "file_digest", "numbered_siblings", "program", "source_digest"]

_LIBRARIES = ("numpy", "scipy", "numba", "usd-core", "OpenImageIO", "pygltflib", "trimesh")
# The resolution of asset paths may depend on these.
_ENVIRONMENT = ("PXR_AR_DEFAULT_SEARCH_PATH", "PXR_PLUGINPATH_NAME", "NUMBA_DISABLE_JIT")
_NUMBERED = re.compile(r"(.*\.)(\d+)(\.[^.]+)")

_SETTLED = 2.0  # s; file systems have clocks as coarse
_digests: dict[tuple[int, ...], str] = {}


def file_digest(path: Path) -> str | None:
    """Return the SHA-256 of a file; None where it cannot be read.

    A file is read once by a process, and again only if its device, inode, size or times differ, or
    are so new that a change may not show in them.
    """
    try:
        with path.open("rb") as file:
            status = os.fstat(file.fileno())
            times = status.st_mtime_ns, status.st_ctime_ns
            identity = (status.st_dev, status.st_ino, status.st_size, *times)
            if identity in _digests:
                return _digests[identity]
            digest = hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return None
    if time.time() - max(status.st_mtime, status.st_ctime) > _SETTLED:
        _digests[identity] = digest
    return digest


def content_key(
    files: Mapping[str, str], absent: Iterable[str], siblings: Mapping[str, Any], options: Any
) -> str:
    """Return the key of a result.

    Parameters
    ----------
    files : mapping of str to str
        Digest of each file, by its name relative to the shot.
    absent : iterable of str
        Files that are named but not there.
    siblings : mapping of str to list of str
        From `numbered_siblings`.
    options : plain values
    """
    content = [sorted(files.items()), sorted(absent), dict(siblings), options, program()]
    text = json.dumps(content, sort_keys=True, default=list)
    return hashlib.sha256(text.encode("utf-8", "surrogateescape")).hexdigest()


def numbered_siblings(files: Iterable[Path]) -> dict[str, list[str]]:
    """Return the files beside numbered ones: tiles of a texture, clips of a template.

    A new one is part of the asset, although no file names it: ``skin.1001.png``.
    """
    patterns: dict[tuple[Path, str, str], None] = {}
    for file in files:
        if found := _NUMBERED.fullmatch(file.name):
            patterns[file.parent, found[1], found[3]] = None
    siblings = {}
    for folder, start, end in patterns:
        names = os.listdir(folder) if folder.is_dir() else []  # noqa: PTH208
        matches = (m for m in map(_NUMBERED.fullmatch, names) if m)
        siblings[str(folder / f"{start}#{end}")] = sorted(
            m.string for m in matches if (m[1], m[3]) == (start, end)
        )
    return siblings


@cache
def program() -> dict[str, Any]:
    """Return the program's identity as plain values: equal where equal results are computed."""
    plugged = sorted(
        f"{group} {point.name} {point.value} {_version_of(point)} {_source_of(point)}"
        for group, points in _usdface_groups().items()
        for point in points
    )
    return {
        "source": source_digest(Path(__file__).parents[1]),
        "python": platform.python_version(),
        "machine": platform.machine(),
        "libraries": {name: _version(name) for name in _LIBRARIES},
        "plugins": plugged,
        "environment": {name: os.environ.get(name, "") for name in _ENVIRONMENT},
    }


def source_digest(package: Path) -> str:
    """Return the SHA-256 of the files of a package.

    Those in ``__pycache__`` are ignored: it has Python's bytecode, and numba's compiled code from
    the first run on.
    """
    source = hashlib.sha256()
    for file in sorted(package.rglob("*")):
        name = file.relative_to(package)
        if file.is_file() and "__pycache__" not in name.parts:
            source.update(name.as_posix().encode() + b"\0")
            source.update(file.read_bytes())
    return source.hexdigest()


def _usdface_groups() -> dict[str, Any]:
    points = entry_points()
    groups = (group for group in points.groups if group.startswith("usdface"))
    return {group: points.select(group=group) for group in groups}


def _version_of(point: Any) -> str:
    return str(point.dist.version) if point.dist else ""


def _source_of(point: Any) -> str:
    """Return the digest of the package of another package's function, "" where it has no files."""
    spec = find_spec(point.value.partition(":")[0].partition(".")[0])
    if spec is None or not spec.origin:
        return ""
    places = [Path(place) for place in spec.submodule_search_locations or ()]
    files = [file for place in places for file in sorted(place.rglob("*.py"))]
    source = hashlib.sha256()
    for file in files or [Path(spec.origin)]:
        source.update((file_digest(file) or "").encode())
    return source.hexdigest()


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return ""
