"""A sandbox for USD files from outside: they are opened in a process of their own first.

A damaged file may end the process that opens it, or take any memory or time, within USD. So a
worker with limits of both opens and reads it before this process does. A file that was opened once
is known by device, inode, size and change time, and so is every layer that it is composed of: it is
tried again only after a change.
"""

import hashlib
import json
import os
import subprocess
import sys
import time
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from usdface.errors import InputError
from usdface.io.no_window import NO_WINDOW
from usdface.user_cache import user_cache_folder

__all__ = ["RefusedError", "try_to_open"]

_TRUSTED = "USDFACE_TRUSTED"  # of the environment: files are opened at once
_WORKER = Path(__file__).with_name("sandbox_worker.py")
_TIMEOUT, _PER_BYTE = 60.0, 1 / 1e6  # s, for a file that waits for something; other limits: there
_LONGEST = 300  # characters of a worker's output
_MOST_KNOWN = 4096  # files of the folder that remembers
# s for which a refused file is not tried again: a command opens it several times, to list its
# inputs and to read it. Not longer, as a layer of it may be repaired meanwhile.
_REFUSED_FOR = 10.0
_refused: dict[str, tuple[float, list[int], str, str]] = {}  # when, its state, word, code


class RefusedError(InputError):
    """A file that is not to be opened in this process."""


def try_to_open(path: Path, within: Path | None = None) -> None:
    """Open a USD file in a process with limits, unless files are trusted or it is known.

    A layer that is opened alone is known, too, if a file `within` which it is composed is.

    Raises
    ------
    RefusedError
        If it is empty, or that process ends, takes too much memory or time, or cannot read a value;
        also of trusted files, if its path is not UTF-8.
    """
    try:
        str(path.absolute()).encode()
    except UnicodeEncodeError as error:
        remedy = "rename it, or name it in a locale of UTF-8"
        raise RefusedError(
            f"{path.absolute()} is not UTF-8, as USD wants it; {remedy}", "FILE_UNREADABLE"
        ) from error
    if path.is_file() and not path.stat().st_size:  # USD's words for it are those of mmap
        raise RefusedError(f"{path} is empty", "FILE_UNREADABLE")
    if os.environ.get(_TRUSTED, "0") not in ("", "0"):
        return
    python = _python()
    if python is None:
        return
    memory = _memory_of(path)
    if memory is not None and _known(memory):
        return
    if within is not None and _known_within(path, within):
        return
    if refusal := _refused_lately(path):
        raise refusal
    answer = _open_in_worker(python, path)
    if refused := answer.get("refused"):
        word, code = str(refused)[:_LONGEST], str(answer.get("code", "TOO_LARGE"))
        _refused[str(path.absolute())] = time.monotonic(), _state(str(path)), word, code
        raise RefusedError(f"{path} {word}", code)
    if memory is not None:
        _remember(memory, [str(name) for name in answer.get("files", ())])


def _refused_lately(path: Path) -> RefusedError | None:
    """Return the refusal of a file that has not changed since it was refused, a moment ago."""
    now = time.monotonic()
    for name in [name for name, held in _refused.items() if now - held[0] > _REFUSED_FOR]:
        _refused.pop(name, None)
    held = _refused.get(str(path.absolute()))
    if held is None or held[1] != _state(str(path)):
        return None
    return RefusedError(f"{path} {held[2]}", held[3])


def _python() -> str | None:
    """Return a Python to run the worker with; None in a host that has none of its own."""
    for place in (sys.executable, str(Path(sys.prefix, "bin", "python3"))):
        if place and Path(place).stem.startswith("python") and Path(place).is_file():
            return place
    return None


def _open_in_worker(python: str, path: Path) -> dict[str, Any]:
    command = [python, "-P", str(_WORKER), str(path.absolute())]
    environment = {**os.environ, "PXR_WORK_THREAD_LIMIT": "1", "PYTHONPATH": _places()}
    timeout = _TIMEOUT + _PER_BYTE * path.stat().st_size
    try:
        done = subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=environment,
            timeout=timeout,
            creationflags=NO_WINDOW,
        )
    except subprocess.TimeoutExpired:
        return {"refused": f"does not open within {timeout:.0f} s"}
    with suppress(ValueError):
        found = json.loads(done.stdout)
        if isinstance(found, dict):
            return found
    if done.returncode in (-24, -9):  # SIGXCPU
        return {"refused": "takes too much time to open"}
    return {"refused": "ends the process that opens it, or takes too much memory; is it damaged?"}


def _places() -> str:
    """Return the path of modules for the worker, which takes the USD of this process.

    A program that brings its own USD may have put it on the path at run time.
    """
    package = find_spec("pxr")
    places = package.submodule_search_locations if package else None
    folders = [str(Path(place).parent) for place in places or ()]
    return os.pathsep.join(filter(None, (*folders, os.environ.get("PYTHONPATH"))))


def _memory_of(path: Path) -> Path | None:
    """Return the file that remembers a path; None where there is no place for such."""
    folder = user_cache_folder("opened")
    if folder is None:
        return None
    key = hashlib.sha256(os.fsencode(path.resolve())).hexdigest()[:32]
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        status = folder.stat()
        if hasattr(os, "getuid") and (status.st_uid != os.getuid() or status.st_mode & 0o022):
            return None  # writable by others
    except OSError:
        return None
    return folder / f"{key}.json"


def _known(memory: Path) -> bool:
    with suppress(OSError, ValueError, AttributeError):
        held = json.loads(memory.read_text(encoding="utf-8"))
        return bool(held) and all(_state(name) == state for name, state in held.items())
    return False


def _known_within(path: Path, root: Path) -> bool:
    memory, place = _memory_of(root), path.resolve()
    if memory is None or not _known(memory):
        return False
    with suppress(OSError, ValueError, AttributeError):
        return any(
            Path(name).resolve() == place for name in json.loads(memory.read_text(encoding="utf-8"))
        )
    return False


def _remember(memory: Path, files: list[str]) -> None:
    with suppress(OSError):
        held = {name: _state(name) for name in files}
        if not held:
            return
        known = sorted(memory.parent.iterdir(), key=lambda p: p.stat().st_mtime_ns)
        for old in known[: max(0, len(known) - _MOST_KNOWN)]:
            old.unlink(missing_ok=True)
        half = memory.with_suffix(f".{os.getpid()}")
        half.write_text(json.dumps(held), encoding="utf-8")
        half.replace(memory)


def _state(name: str) -> list[int]:
    status = Path(name).stat()
    return [status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns, status.st_ctime_ns]
