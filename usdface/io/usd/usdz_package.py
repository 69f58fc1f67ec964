"""The container of `.usdz`: a zip of uncompressed files whose data begin at multiples of 64 bytes.

Source: OpenUSD, "Usdz File Format Specification"; PKWARE, APPNOTE 4.5 (extra fields).
"""

import struct
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path

from usdface.errors import OutputError

__all__ = ["write_package"]

_ALIGNMENT = 64  # bytes; USDZ specification, "Layout"
_LOCAL_HEADER = 30  # bytes, before name and extra field
_PADDING = 0x1986  # the header id that USD's own writer gives its padding
_EPOCH = (1980, 1, 1, 0, 0, 0)  # the first time that a zip can hold


def write_package(path: Path, files: Mapping[str, bytes]) -> None:
    """Write a package of `files` by name, in order, and verify its content.

    Equal files give equal bytes.

    Raises
    ------
    OutputError
        If it is larger than 2 GiB, or its content differs.
    OSError
        If it cannot be written.
    """
    try:
        # The specification has no zip64.
        with path.open("wb") as file, zipfile.ZipFile(file, "w", allowZip64=False) as package:
            for name, data in files.items():
                info = zipfile.ZipInfo(name, _EPOCH)
                info.create_system = 0  # the same on every system
                info.extra = _padding(file.tell() + _LOCAL_HEADER + len(name.encode()))
                package.writestr(info, data)
    except zipfile.LargeZipFile as error:
        raise OutputError("the package is larger than 2 GiB, the most that is written") from error
    meant = {name: (len(data), zlib.crc32(data)) for name, data in files.items()}
    if _entries(path) != meant:
        raise OutputError(
            "the content of the package differs from the written data; is the disk damaged?"
        )


def _padding(start: int) -> bytes:
    """Return the extra field after which data are aligned, for one that begins at `start`."""
    size = -(start + 4) % _ALIGNMENT
    return struct.pack("<HH", _PADDING, size) + bytes(size)


def _entries(path: Path) -> dict[str, tuple[int, int]]:
    """Return size and CRC-32 of a package's files, by name; empty if it is damaged."""
    try:
        with zipfile.ZipFile(path) as package:
            damaged = package.testzip()
            held = {info.filename: (info.file_size, info.CRC) for info in package.infolist()}
            return {} if damaged else held
    except (EOFError, zipfile.BadZipFile):
        return {}
