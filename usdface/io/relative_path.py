"""Paths relative to a folder, as files name each other so that they can be moved together."""

import os
from contextlib import suppress
from pathlib import Path

__all__ = ["relative_path"]


def relative_path(path: Path, folder: Path) -> str:
    """Return a path relative to a folder, with slashes; an absolute one if there is none.

    Nothing leads from one drive of Windows to another. Links are not followed: their target may
    change.
    """
    relative = path.absolute()
    with suppress(ValueError):
        relative = Path(os.path.relpath(path, folder))
    return relative.as_posix()
