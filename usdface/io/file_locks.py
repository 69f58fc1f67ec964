"""Locks of folders between processes: they end with their process, however it ends.

A lock is on the folder itself, so that no lock file is left behind. Where a system or a file
system has no such locks (Windows, some network disks), `locked` says so.
"""

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

__all__ = ["FolderLock", "same_folder", "try_lock", "wait_for_lock"]

_PAUSE = 0.005  # s between two attempts


class FolderLock:
    """A folder that this process has locked.

    Attributes
    ----------
    identity : tuple of int
        Device and inode of the folder.
    sure : bool
        False where the system has no such locks: other processes may hold it, too.
    """

    def __init__(self, descriptor: int | None, identity: tuple[int, int], sure: bool) -> None:
        self._descriptor = descriptor
        self.identity = identity
        self.sure = sure

    def release(self) -> None:
        """Let others lock the folder; nothing happens the second time."""
        if self._descriptor is not None:
            os.close(self._descriptor)
            self._descriptor = None


def try_lock(folder: Path) -> FolderLock | None:
    """Lock a folder; None where another process, or another job of this one, holds it.

    Raises
    ------
    OSError
        If there is no such folder.
    """
    if fcntl is None:
        return FolderLock(None, _identity(folder), False)
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    sure = True
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(descriptor)
        return None
    except OSError:  # a file system without locks of folders
        sure = False
    status = os.fstat(descriptor)
    return FolderLock(descriptor, (status.st_dev, status.st_ino), sure)


@contextmanager
def wait_for_lock(folder: Path, most: float) -> Iterator[FolderLock]:
    """Hold the lock of a folder, waiting for it for at most some seconds.

    Raises
    ------
    TimeoutError
        If another process holds it for longer.
    """
    end = time.monotonic() + most
    while (lock := try_lock(folder)) is None:
        if time.monotonic() > end:
            raise TimeoutError(f"another process has locked {folder} for {most:g} s")
        time.sleep(_PAUSE)
    try:
        yield lock
    finally:
        lock.release()


def same_folder(folder: Path, lock: FolderLock) -> bool:
    """Return whether `folder` still exists and is the locked one."""
    with suppress(OSError):
        return _identity(folder) == lock.identity
    return False


def _identity(folder: Path) -> tuple[int, int]:
    status = folder.stat()
    return status.st_dev, status.st_ino
