"""Atomic writing: after a failure, or a kill, either all files are the old ones or all are new."""

import os
import signal
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from types import FrameType

from usdface.errors import OutputError
from usdface.io.staging import Staging, Step, put_in_place
from usdface.signals import ENDING_SIGNALS

__all__ = [
    "StrPath",
    "all_or_none",
    "atomic_path",
    "check_place",
    "remove_when_written",
    "staged_files",
    "when_written",
    "write_bridge",
    "write_bytes",
    "write_text",
]


StrPath = str | os.PathLike[str]


def check_place(path: Path) -> None:
    """Fail early if `path` cannot be written.

    Raises
    ------
    OutputError
        If it is a folder, or the folder that it would go to is none, is read-only or may not be
        entered, or if no file can have that name.
    """
    folder = path.parent
    try:
        while not folder.exists():
            folder = folder.parent
        taken, found = path.is_dir(), folder.is_dir()
        if taken or not found or not os.access(folder, os.W_OK):
            reason = f"{path if taken else folder} is "
            reason += "a folder" if taken else "read-only" if found else "no folder"
            raise OutputError(f"cannot write {path}: {reason}; choose a place that can be written")
        _check_name(path)
    except OSError as error:
        raise _unwritable(path, error) from error


@dataclass(slots=True)
class _File:
    """A finished file in a staging folder, and its bridge if it has one."""

    staging: Path
    temporary: Path
    place: Path
    bridge: Path | None = None


class _Writing:
    """Files that are written to staging folders; `undo` removes the remaining ones."""

    def __init__(self, undo: ExitStack) -> None:
        self.undo = undo
        self.finished: list[_File] = []
        self.removed: list[Path] = []
        self.afterwards: list[Callable[[], object]] = []
        self._stagings: dict[Path, Staging] = {}

    def staging(self, folder: Path) -> Staging:
        """Return the staging folder in `folder`, which is made if it is missing."""
        if folder not in self._stagings:
            self.undo.enter_context(_folder(folder))
            made = Staging(folder)
            self.undo.callback(made.remove)
            self._stagings[folder] = made
        return self._stagings[folder]

    def commit(self) -> None:
        steps = self._steps()
        try:
            with _signals_later():
                if steps:
                    put_in_place(steps, [step.staging.parent for step in steps])
                for action in self.afterwards:
                    action()
        except OSError as error:
            raise _unwritable(self.finished[-1].place, error) from error

    def _steps(self) -> list[Step]:
        """Return the moves in an order such that a reader never finds two generations mixed.

        Bridges first, which reference the other new files in their staging folders, then those
        files, at last the files that bridges replace.
        """
        bridged = any(file.bridge for file in self.finished)
        first = [
            Step("move", file.staging, file.bridge.name, file.place.name)
            for file in self.finished
            if file.bridge
        ]
        others = [
            Step("link" if bridged else "move", file.staging, file.temporary.name, file.place.name)
            for file in self.finished
            if not file.bridge
        ]
        last = [
            Step("move", file.staging, file.temporary.name, file.place.name)
            for file in self.finished
            if file.bridge
        ]
        gone = [
            Step("remove", self.staging(place.parent).path, "", place.name)
            for place in self.removed
            if place.is_file()
        ]
        return first + others + last + gone


_WRITING: ContextVar[_Writing | None] = ContextVar("_WRITING", default=None)


@contextmanager
def all_or_none() -> Iterator[None]:
    """Replace all files that are written in the block at its end, or none.

    If the process is killed between two of the moves, the next reader or writer there completes
    them (`usdface.io.staging`). Within another `all_or_none` it is part of that.
    """
    with _all_or_none():
        yield


@contextmanager
def _all_or_none() -> Iterator[_Writing]:
    """Yield the files of the `all_or_none` around, or of one that begins here."""
    writing = _WRITING.get()
    if writing is not None:
        yield writing
        return
    undo = ExitStack()
    writing = _Writing(undo)
    try:
        token = _WRITING.set(writing)
        try:
            yield writing
        finally:
            _WRITING.reset(token)
        writing.commit()
    finally:
        with _signals_later():
            undo.close()


def when_written(action: Callable[[], object]) -> None:
    """Call `action` after the files are replaced: at the end of `all_or_none`, or at once."""
    writing = _WRITING.get()
    if writing is None:
        action()
    else:
        writing.afterwards.append(action)


def remove_when_written(path: Path) -> None:
    """Remove a file of an earlier result as part of the `all_or_none` around, if it is there."""
    with _all_or_none() as writing:
        writing.removed.append(path)


@contextmanager
def atomic_path(path: Path) -> Iterator[Path]:
    """Yield a temporary path near `path` with the same suffix; it replaces `path` at the end.

    If the block raises, or the file was not written, the old file stays and nothing
    else is left behind. The folder of `path` is made if it is missing. Within `all_or_none` the
    file is replaced at the end of that.

    Raises
    ------
    OutputError
        If the folder or the file cannot be written.
    """
    with _all_or_none() as writing:
        try:
            if path.is_dir():
                raise IsADirectoryError(f"{path} is a folder")
            _check_name(path)
            staging = writing.staging(path.parent)
            temporary = staging.new_file(path.suffix)
            writing.undo.callback(temporary.unlink, missing_ok=True)
            yield temporary
        except OSError as error:
            raise _unwritable(path, error) from error
        writing.finished.append(_File(staging.path, temporary, path))


def staged_files() -> Mapping[Path, Path]:
    """Return the staged path of each file of the enclosing `all_or_none`, by its final path."""
    writing = _WRITING.get()
    return {file.place: file.temporary for file in writing.finished} if writing else {}


@contextmanager
def write_bridge(path: Path) -> Iterator[Path]:
    """Yield a temporary path for the bridge of `path`, which was written in this `all_or_none`.

    A bridge has the content of `path`, but references the other new files by `staged_files`. It is
    at `path` while they are moved: opened then, or after a kill, `path` gives all of the new
    result.
    """
    writing = _WRITING.get()
    assert writing is not None
    file = next(file for file in reversed(writing.finished) if file.place == path)
    try:
        bridge = writing.staging(path.parent).new_file(path.suffix)
        yield bridge
    except OSError as error:
        raise _unwritable(path, error) from error
    file.bridge = bridge


def _check_name(path: Path) -> None:
    """Fail if no file can have that name: a staged file has another name."""
    with suppress(FileNotFoundError):
        path.lstat()


def _unwritable(path: Path, error: OSError) -> OutputError:
    reason = error.strerror or error
    return OutputError(f"cannot write {path}: {reason}; choose a place that can be written")


@contextmanager
def _folder(folder: Path) -> Iterator[Path]:
    """Make a folder; remove it at the end if it is empty."""
    made = [place for place in (folder, *folder.parents) if not place.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        yield folder
    finally:
        for place in made:
            with suppress(OSError):
                place.rmdir()


@contextmanager
def _signals_later() -> Iterator[None]:
    """Keep signals that end a command until the block is done, which takes milliseconds."""
    if threading.current_thread() is not threading.main_thread():
        yield  # signals are handled in the main thread
        return
    kept: list[int] = []

    def keep(number: int, frame: FrameType | None) -> None:
        kept.append(number)

    previous = {
        number: signal.signal(number, keep)
        for number in ENDING_SIGNALS
        if callable(signal.getsignal(number))
    }
    try:
        yield
    finally:
        for handled, handler in previous.items():
            signal.signal(handled, handler)
    for number in kept:
        signal.raise_signal(number)


def write_bytes(path: Path, *data: bytes) -> None:
    """Write `data`, one part after the other, to `path` atomically."""
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        file.writelines(data)


def write_text(path: Path, text: str) -> None:
    """Write `text` to `path` atomically, as UTF-8; file names may hold other bytes."""
    write_bytes(path, text.encode(errors="backslashreplace"))
