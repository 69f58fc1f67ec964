"""Atomic writing: after a failure the old files are unchanged."""

import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path

from usdface.errors import OutputError

__all__ = [
    "StrPath",
    "all_or_none",
    "atomic_path",
    "check_place",
    "when_written",
    "write_bytes",
    "write_text",
]


StrPath = str | os.PathLike[str]


def check_place(path: Path) -> None:
    """Fail before the work rather than after it where `path` cannot be written.

    Raises
    ------
    OutputError
        If it is a folder, or the folder that it would go to is none or is read-only.
    """
    folder = path.parent
    while not folder.exists():
        folder = folder.parent
    if path.is_dir() or not folder.is_dir() or not os.access(folder, os.W_OK):
        reason = f"{path if path.is_dir() else folder} is "
        reason += "a folder" if path.is_dir() else "read-only" if folder.is_dir() else "no folder"
        raise OutputError(f"cannot write {path}: {reason}; choose a place that can be written")


class _Writing:
    """Files that are written aside; `undo` removes those that are left."""

    def __init__(self, undo: ExitStack) -> None:
        self.undo = undo
        self.finished: list[tuple[Path, Path]] = []  # temporary file and its place
        self.afterwards: list[Callable[[], object]] = []

    def commit(self) -> None:
        for temporary, path in self.finished:
            try:
                temporary.replace(path)
            except OSError as error:
                raise _unwritable(path, error) from error
        for action in self.afterwards:
            action()


_WRITING: ContextVar[_Writing | None] = ContextVar("_WRITING", default=None)


@contextmanager
def all_or_none() -> Iterator[None]:
    """Replace all files that are written in the block at its end, or none.

    They are put in place in the order in which they were finished. Within another `all_or_none`
    it is part of that.
    """
    if _WRITING.get() is not None:
        yield
        return
    with ExitStack() as undo:
        writing = _Writing(undo)
        token = _WRITING.set(writing)
        try:
            yield
        finally:
            _WRITING.reset(token)
        writing.commit()


def when_written(action: Callable[[], object]) -> None:
    """Call `action` after the files are replaced: at the end of `all_or_none`, or at once."""
    writing = _WRITING.get()
    if writing is None:
        action()
    else:
        writing.afterwards.append(action)


@contextmanager
def atomic_path(path: Path) -> Iterator[Path]:
    """Yield a temporary path beside `path` with the same suffix; it replaces `path` at the end.

    If the block raises, or the file was not written, the old file stays and nothing
    else is left behind. The folder of `path` is made if it is missing. Within `all_or_none` the
    file is replaced at the end of that.

    Raises
    ------
    OutputError
        If the folder or the file cannot be written.
    """
    with all_or_none():
        writing = _WRITING.get()
        assert writing is not None
        try:
            if path.is_dir():
                raise IsADirectoryError(f"{path} is a folder")
            folder = writing.undo.enter_context(_folder(path.parent))
            handle, name = tempfile.mkstemp(prefix=f".{path.stem}-", suffix=path.suffix, dir=folder)
            os.close(handle)
            temporary = Path(name)
            writing.undo.callback(temporary.unlink, missing_ok=True)
            yield temporary
            # mkstemp makes files private; a result should be as readable as any new file.
            mask = os.umask(0)
            os.umask(mask)
            temporary.chmod(0o666 & ~mask)
        except OSError as error:
            raise _unwritable(path, error) from error
        writing.finished.append((temporary, path))


def _unwritable(path: Path, error: OSError) -> OutputError:
    reason = error.strerror or error
    return OutputError(f"cannot write {path}: {reason}; choose a place that can be written")


@contextmanager
def _folder(folder: Path) -> Iterator[Path]:
    """Make a folder; if nothing is in it at the end, it goes again."""
    made = [place for place in (folder, *folder.parents) if not place.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        yield folder
    finally:
        for place in made:
            with suppress(OSError):
                place.rmdir()


def write_bytes(path: Path, *data: bytes) -> None:
    """Write `data`, one part after the other, to `path` atomically."""
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        file.writelines(data)


def write_text(path: Path, text: str) -> None:
    """Write `text` to `path` atomically, as UTF-8."""
    write_bytes(path, text.encode())
