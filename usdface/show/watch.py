"""Waiting until a file of a sequence changes."""

import time
from collections.abc import Callable, Iterable
from pathlib import Path

from usdface.show.plan import ShotPlan
from usdface.show.record import read_record, record_path

__all__ = ["FileStates", "files_of", "states_of", "wait_for_change"]

_PAUSE = 0.5  # s between two polls
_SETTLED = 2  # polls without a change, after which a program that writes several files is done

FileStates = dict[Path, tuple[int, int]]


def files_of(sources: Iterable[Path], plans: Iterable[ShotPlan]) -> list[Path]:
    """Return the files whose change may make a shot out of date, as far as they are known.

    Those of the layers below a shot are known from its record, once it was processed.
    """
    files = dict.fromkeys(sources)
    for plan in plans:
        files[plan.file] = None
        files |= dict.fromkeys(plan.making.files if plan.making else ())
        for name in ("record", "made"):
            if record := read_record(record_path(plan.file, name)):
                named = (*record.files, *record.absent)
                files |= dict.fromkeys(plan.file.parent / each for each in named)
    return list(files)


def wait_for_change(files: Callable[[], Iterable[Path]], since: FileStates) -> None:
    """Return when one of the files has changed, appeared or vanished, and changes have stopped.

    Parameters
    ----------
    files : callable
        Called at each poll, since a folder may have new ones.
    since : mapping
        Earlier states of some files, from `states_of`: a change since then counts, too.
    """
    before = states_of(files())
    before |= {file: state for file, state in since.items() if file in before}
    while (now := states_of(files())) == before:
        time.sleep(_PAUSE)
    quiet = 0
    while quiet < _SETTLED:
        time.sleep(_PAUSE)
        last, now = now, states_of(files())
        quiet = quiet + 1 if now == last else 0


def states_of(files: Iterable[Path]) -> FileStates:
    """Return time [ns] and size of those files that are there."""
    state = {}
    for file in files:
        try:
            status = file.stat()
        except OSError:
            continue
        state[file] = (status.st_mtime_ns, status.st_size)
    return state
