"""Staging folders: files are written there, and moved to their places together.

A run writes into a hidden folder ``.usdface-...`` beside each output, which it locks while it
lives. To put the files in place it first writes a journal of the moves into each staging folder;
the journal of the first one, which names the others, decides: with it the result is the new one,
and whoever comes next finishes the moves of a run that was killed. Without it the staging folder
of a dead run is litter.

A journal moves files of its own staging folder to names in the folder around it, and only if it
knows device, inode and change time of a file beside it, which nobody can choose: so one that came
in an archive does nothing.
"""

import atexit
import json
import os
import secrets
import shutil
from collections.abc import Collection, Iterator, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from usdface.io.file_locks import same_folder, try_lock, wait_for_lock

__all__ = ["Staging", "Step", "finish_dead_runs", "put_in_place"]

_PREFIX, _JOURNAL, _MARK = ".usdface-", "journal", "mark"
_LONGEST_WAIT = 60.0  # s for another run to put its files in place, which takes milliseconds
_LARGEST_JOURNAL = 2**24  # bytes


# Of this process, to be removed at its end if a signal came in between.
_living: dict[Path, int] = {}


class Staging:
    """A locked folder beside outputs, for files that are not finished."""

    def __init__(self, folder: Path) -> None:
        while True:
            self.path = folder.absolute() / f"{_PREFIX}{secrets.token_hex(6)}"
            _living[self.path] = os.getpid()
            self.path.mkdir()
            with suppress(OSError):  # another run removed it as that of a dead one
                lock = try_lock(self.path)
                if lock is not None and same_folder(self.path, lock):
                    break
        self._lock = lock
        self._count = 0

    def new_file(self, suffix: str) -> Path:
        """Make an empty file that is as readable as any new one."""
        self._count += 1
        path = self.path / f"{self._count}{suffix}"
        path.touch()
        return path

    def remove(self) -> None:
        """Remove the folder with all that is left in it."""
        shutil.rmtree(self.path, ignore_errors=True)
        self._lock.release()
        _living.pop(self.path, None)


@atexit.register
def _remove_living() -> None:
    for path, process in _living.items():
        if process == os.getpid():
            shutil.rmtree(path, ignore_errors=True)


@dataclass(frozen=True, slots=True)
class Step:
    """One move of a staged file to its place in the folder around its staging folder.

    Attributes
    ----------
    kind : str
        ``move``; ``link``, after which the staged file is still there; or ``remove``, which
        removes the file or folder at `place`.
    staging : Path
        The staging folder.
    name : str
        Of the file in it; "" to remove.
    place : str
        A name in the folder around.
    """

    kind: str
    staging: Path
    name: str
    place: str

    def run(self) -> None:
        """Make the move; one that was made before is left out."""
        source, place = self.staging / self.name, self.staging.parent / self.place
        if self.kind == "remove":
            place.unlink(missing_ok=True)
        elif self.kind == "move":
            with suppress(FileNotFoundError):
                source.replace(place)
        else:
            twin = self.staging / f"{self.name}.twin"
            twin.unlink(missing_ok=True)
            try:
                os.link(source, twin)
            except FileNotFoundError:
                return
            except OSError:  # a file system without hard links
                shutil.copyfile(source, twin)
            twin.replace(place)


def put_in_place(steps: Sequence[Step], folders: Sequence[Path]) -> None:
    """Make all steps, or none if a journal cannot be written; a kill between two is made good.

    One run at a time does so in any of the `folders` around the staging folders.

    Raises
    ------
    OSError
    """
    with ExitStack() as held:
        locks = [
            held.enter_context(wait_for_lock(folder, _LONGEST_WAIT))
            for folder in sorted({Path(os.path.realpath(folder)) for folder in folders})
        ]
        mine = {lock.identity for lock in locks}
        for folder in folders:
            _finish_in(folder, mine)
        stagings = list(dict.fromkeys(step.staging for step in steps))
        if len(steps) == 1:
            steps[0].run()
            return
        for step in steps:  # a journal that outlives a power failure must not move empty files
            if step.name:
                _to_disk(step.staging / step.name)
        for staging in reversed(stagings):  # the first one's decides
            _write_journal(staging, stagings, steps)
        try:
            _run(steps)
        finally:  # made or undone
            for staging in reversed(stagings):
                (staging / _JOURNAL).unlink()


def _run(steps: Sequence[Step]) -> None:
    """Make all steps; if one fails, undo those before it."""
    with ExitStack() as undo:
        for number, step in enumerate(steps):
            place, old = step.staging.parent / step.place, step.staging / f"{number}.old"
            if place.is_file():
                with suppress(OSError):  # a file system without hard links
                    os.link(place, old)
                    undo.callback(old.replace, place)
            elif step.kind != "remove" and not place.is_dir():
                undo.callback(place.unlink, missing_ok=True)
            step.run()
        undo.pop_all()


def finish_dead_runs(folder: Path) -> None:
    """Complete the moves that dead runs had committed to, and remove their other files.

    Folders that cannot be written, or are in use by another run, are left as they are.
    """
    with suppress(OSError):
        if not any(_staging_folders(folder)):
            return
        lock = try_lock(folder)
        if lock is not None:
            try:
                _finish_in(folder, {lock.identity})
            finally:
                lock.release()


def _finish_in(folder: Path, held: Collection[tuple[int, int]]) -> None:
    for staging in list(_staging_folders(folder)):
        with suppress(OSError):
            lock = try_lock(staging)
            if lock is None:
                continue
            try:
                if lock.sure and same_folder(staging, lock):
                    _finish(staging, held)
            finally:
                lock.release()


def _finish(staging: Path, held: Collection[tuple[int, int]]) -> None:
    """Finish or remove a staging folder of a dead run; that of a foreign journal is left alone."""
    if not (staging / _JOURNAL).exists():
        shutil.rmtree(staging)
        return
    journal = _read_journal(staging)
    if journal is None:
        return
    first = Path(journal["stagings"][0])
    with ExitStack() as stack:
        if first != staging and (not first.is_dir() or not _also_locked(first, held, stack)):
            if not first.is_dir():  # all moves are made
                shutil.rmtree(staging)
            return
        decision = journal if first == staging else _read_journal(first)
        if decision is None:
            if not (first / _JOURNAL).exists():  # not committed, or all moves are made
                shutil.rmtree(staging)
            return
        stagings = [Path(name) for name in decision["stagings"] if Path(name).is_dir()]
        others = [place for place in stagings if place not in (first, staging)]
        if not all(_also_locked(place, held, stack) for place in others):
            return
        journals = {place: _read_journal(place) for place in stagings}
        for _, step in sorted(
            (number, Step(kind, place, name, target))
            for place, found in journals.items()
            if found is not None and found["stagings"] == decision["stagings"]
            for number, kind, name, target in found["steps"]
        ):
            step.run()
        for place in reversed(stagings):
            shutil.rmtree(place)


def _also_locked(staging: Path, held: Collection[tuple[int, int]], stack: ExitStack) -> bool:
    """Lock another staging folder of a dead run, and the folder around it."""
    try:
        locks = [try_lock(staging)]
        status = staging.parent.stat()
        if (status.st_dev, status.st_ino) not in held:
            locks.append(try_lock(staging.parent))
    except OSError:
        return False
    for lock in locks:
        if lock is not None:
            stack.callback(lock.release)
    return all(lock is not None and lock.sure for lock in locks)


def _staging_folders(folder: Path) -> Iterator[Path]:
    with os.scandir(folder) as entries:
        for entry in entries:
            if entry.name.startswith(_PREFIX) and entry.is_dir(follow_symlinks=False):
                yield Path(entry.path).absolute()


def _write_journal(staging: Path, stagings: Sequence[Path], steps: Sequence[Step]) -> None:
    mark = staging / _MARK
    mark.touch()
    journal = {
        "mark": _identity(mark),
        "stagings": [str(place.absolute()) for place in stagings],
        "steps": [
            (number, step.kind, step.name, step.place)
            for number, step in enumerate(steps)
            if step.staging == staging
        ],
    }
    half = staging / f"{_JOURNAL}-half"
    with half.open("w", encoding="utf-8", errors="surrogateescape") as file:
        json.dump(journal, file, ensure_ascii=False)
    _to_disk(half)
    half.replace(staging / _JOURNAL)


def _to_disk(file: Path) -> None:
    with file.open("rb") as opened:
        os.fsync(opened.fileno())


def _read_journal(staging: Path) -> dict[str, Any] | None:
    """Return the journal of a staging folder if a run of usdface wrote it there, else None."""
    file = staging / _JOURNAL
    try:
        if file.is_symlink() or file.stat().st_size > _LARGEST_JOURNAL:
            return None
        journal = json.loads(file.read_text(encoding="utf-8", errors="surrogateescape"))
        if journal["mark"] != _identity(staging / _MARK) or not journal["stagings"]:
            return None
        for number, kind, name, place in journal["steps"]:
            sound = isinstance(number, int) and kind in ("move", "link", "remove")
            if not sound or not _is_name(place) or not (_is_name(name) or kind == "remove"):
                return None
        if any(not Path(name).name.startswith(_PREFIX) for name in journal["stagings"]):
            return None
    except (OSError, ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return None
    return dict(journal)


def _identity(mark: Path) -> list[int]:
    status = mark.stat(follow_symlinks=False)
    return [status.st_dev, status.st_ino, status.st_ctime_ns]


def _is_name(name: object) -> bool:
    return isinstance(name, str) and name not in ("", ".", "..") and Path(name).name == name
