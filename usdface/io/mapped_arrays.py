"""Arrays that grow by rows in files and are then mapped: the system may take their memory back."""

import tempfile
from pathlib import Path
from typing import IO

import numpy as np

from usdface.arrays import FloatArray
from usdface.errors import OutputError

__all__ = ["MappedArrays"]


class MappedArrays:
    """Arrays of float64 in temporary files, which vanish with the last array that maps them.

    Parameters
    ----------
    folder : Path
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._files: dict[str, IO[bytes]] = {}
        self._shapes: dict[str, tuple[int, ...]] = {}

    def append(self, name: str, rows: FloatArray) -> None:
        """Add rows (N, ...) to an array; the first ones begin it.

        Raises
        ------
        OutputError
            If the disk is full.
        """
        try:
            if name not in self._files:
                self._files[name] = tempfile.TemporaryFile(dir=self._folder)  # noqa: SIM115
                self._shapes[name] = (0, *rows.shape[1:])
            # Not into mapped memory, which a full disk would end the process for.
            self._files[name].write(np.ascontiguousarray(rows, np.float64).tobytes())
        except OSError as error:
            raise OutputError(f"cannot write to {self._folder}: {error.strerror}") from error
        self._shapes[name] = (self._shapes[name][0] + len(rows), *rows.shape[1:])

    def mapped(self, name: str) -> FloatArray:
        """Return an array (F, ...) of all its rows, read-only; no more can be added.

        Raises
        ------
        OutputError
            If the disk is full.
        """
        try:
            with self._files.pop(name) as file:
                file.flush()
                return np.asarray(np.memmap(file, np.float64, "r", shape=self._shapes[name]))
        except OSError as error:
            raise OutputError(f"cannot write to {self._folder}: {error.strerror}") from error

    def close(self) -> None:
        """Let go of files that were not mapped."""
        for file in self._files.values():
            file.close()
