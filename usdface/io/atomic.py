"""Writing files so that a failure leaves what was there."""

import os
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from usdface.errors import OutputError

__all__ = ["atomic_path", "check_place", "write_bytes", "write_files", "write_text"]


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


@contextmanager
def atomic_path(path: Path) -> Iterator[Path]:
    """Yield a temporary path beside `path` with the same suffix; it replaces `path` at the end.

    If the block raises, or the file was not written, what was at `path` stays and nothing
    else is left behind. The folder of `path` is made if it is missing.

    Raises
    ------
    OutputError
        If the folder or the file cannot be written.
    """
    try:
        if path.is_dir():
            raise IsADirectoryError(f"{path} is a folder")
        with _folder(path.parent) as folder:
            handle, name = tempfile.mkstemp(prefix=f".{path.stem}-", suffix=path.suffix, dir=folder)
            os.close(handle)
            temporary = Path(name)
            try:
                yield temporary
                # mkstemp makes files private; a result should be as readable as any new file.
                mask = os.umask(0)
                os.umask(mask)
                temporary.chmod(0o666 & ~mask)
                temporary.replace(path)
            finally:
                temporary.unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(
            f"cannot write {path}: {error.strerror or error}; choose a place that can be written"
        ) from error


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


def write_files(files: Mapping[Path, Sequence[bytes]]) -> None:
    """Write several files, each of parts: all aside, then all into place, the first of them last.

    Raises
    ------
    OutputError
        If one cannot be written; then none is replaced.
    """
    with ExitStack() as places:
        for path, parts in files.items():
            temporary = places.enter_context(atomic_path(path))
            with temporary.open("wb") as file:
                file.writelines(parts)


def write_bytes(path: Path, *data: bytes) -> None:
    """Write `data`, one part after the other, to `path` atomically."""
    write_files({path: data})


def write_text(path: Path, text: str) -> None:
    """Write `text` to `path` atomically, as UTF-8."""
    write_bytes(path, text.encode())
