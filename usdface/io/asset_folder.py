"""The folder rule: an asset brings in files of its own folder, or of one that the user names.

A file from outside may name any path. Named files go into results that are passed on, so an
absolute path, ``..`` or a symbolic link must not reach other files of the user.
"""

import os
import stat
from collections.abc import Iterable
from pathlib import Path

from usdface.errors import InputError
from usdface.io.atomic import StrPath

__all__ = ["OUTSIDE", "asset_folder", "is_inside", "read_file"]

OUTSIDE = "is outside the folder of the asset; --asset-root DIR of a folder above both allows it"


def asset_folder(name: StrPath | None) -> Path | None:
    """Return the folder that an option ``asset_root`` names, None where it names none.

    Raises
    ------
    InputError
        If it is no folder.
    """
    if name and not Path(name).is_dir():
        raise InputError(f"--asset-root {name} is no folder", "SETTING_WRONG")
    return Path(name) if name else None


def is_inside(path: Path, folders: Iterable[Path | None]) -> bool:
    """Return whether a path, all symbolic links followed, is one of `folders` or lies in one."""
    try:
        place = Path(os.path.realpath(path))
        return any(place.is_relative_to(os.path.realpath(f)) for f in folders if f is not None)
    except (OSError, ValueError):  # not a valid name on this system
        return False


def read_file(path: Path, most: int) -> bytes:
    """Return the bytes of a regular file; a FIFO or device would block or never end.

    Parameters
    ----------
    path : Path
    most : int
        Largest size [bytes].

    Raises
    ------
    InputError
        If it is missing, of another kind, larger, or may not be read.
    """
    try:
        found = path.stat()
        if not stat.S_ISREG(found.st_mode):
            raise InputError(f"{path} is no regular file", "FILE_UNREADABLE")
        if found.st_size > most:
            raise InputError(f"{path} is larger than {most >> 20} MiB", "TOO_LARGE")
        return path.read_bytes()
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise InputError(f"{path} cannot be read: {reason}", "FILE_UNREADABLE") from error
