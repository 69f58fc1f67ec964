"""Files that USD layers name: which folders they may come from, and their bytes.

Source: OpenUSD, "Usdz File Format Specification" (package-relative paths).
"""

import zipfile
from pathlib import Path

from pxr import Ar, Sdf

from usdface.errors import InputError
from usdface.io.asset_folder import read_file

__all__ = ["LARGEST_ASSET", "folders_of", "outer_file", "read_asset"]

LARGEST_ASSET = 256 * 1024 * 1024  # bytes


def folders_of(layer: Sdf.Layer) -> list[Path]:
    """Return where files that a layer names may lie: its folder; within a package, the package.

    The folder of the layer's own path comes first, that of the file which a symbolic link leads
    to second. A layer in memory has none.
    """
    outer, inner = Ar.SplitPackageRelativePathOuter(layer.realPath)
    if not outer:
        return []
    path = Path(outer)
    if inner or path.suffix.lower() == ".usdz":
        return [path]
    return [path.parent, path.resolve().parent]


def outer_file(resolved: str) -> Path:
    """Return the file on disk that a resolved asset path names, or the package that it is in."""
    return Path(Ar.SplitPackageRelativePathOuter(resolved)[0])


def read_asset(resolved: str) -> bytes:
    """Return the bytes of a file, or of a file in a package.

    Raises
    ------
    InputError
        If it cannot be read, is no regular file, or is larger than `LARGEST_ASSET`.
    """
    outer, inner = Ar.SplitPackageRelativePathOuter(resolved)
    if not inner:
        return read_file(Path(outer), LARGEST_ASSET)
    try:
        with zipfile.ZipFile(outer) as package:
            entry = package.getinfo(inner)
            if entry.compress_type != zipfile.ZIP_STORED:  # small ones may become anything
                raise InputError(
                    f"{inner} is compressed in its package, which USDZ forbids", "SCHEMA_BROKEN"
                )
            if entry.file_size > LARGEST_ASSET:
                raise InputError(f"{inner} is larger than {LARGEST_ASSET >> 20} MiB", "TOO_LARGE")
            return package.read(inner)
    except (OSError, KeyError, RuntimeError, zipfile.BadZipFile) as error:
        message = f"{resolved} cannot be read from its package ({error})"
        raise InputError(message, "FILE_UNREADABLE") from error
