"""Temporary files of libraries that only read and write files by name."""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from usdface.errors import OutputError

__all__ = ["temporary_folder", "temporary_full"]


@contextmanager
def temporary_folder() -> Iterator[Path]:
    """Yield an empty folder, which is removed at the end.

    Raises
    ------
    OutputError
        If there is none, or its disk is full: it may be another one than that of the output.
    """
    try:
        with tempfile.TemporaryDirectory() as folder:
            yield Path(folder)
    except OSError as error:
        raise temporary_full(error.strerror or "") from error


def temporary_full(reason: str) -> OutputError:
    """Return the error for a temporary file that cannot be written."""
    return OutputError(
        f"cannot write temporary files to {tempfile.tempdir or 'any folder'}: {reason}; "
        "name another folder in the environment variable TMPDIR"
    )
