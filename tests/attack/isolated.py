"""The worker that opens USD files first, without the start of a process each time.

A process that has loaded USD and nothing else forks for each file, and the fork does what the
worker's script does, with its limits. `usdface.io.usd.sandbox` sees no difference.
"""

import os
import select
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

__all__ = ["Workers"]


class Workers:
    """Stands for the module `subprocess` in `usdface.io.usd.sandbox`."""

    DEVNULL, PIPE = subprocess.DEVNULL, subprocess.PIPE
    TimeoutExpired = subprocess.TimeoutExpired

    def __init__(self) -> None:
        asked, self._ask = os.pipe()
        self._answers, answers = os.pipe()
        if os.fork() == 0:
            os.close(self._ask)  # so that it ends with this process
            os.close(self._answers)
            _serve(asked, answers)
        os.close(asked)
        os.close(answers)

    def run(
        self, command: list[str], timeout: float, **_: Any
    ) -> subprocess.CompletedProcess[bytes]:
        """Open the file that the last word names, as the worker's script does."""
        path, number = command[-1], time.monotonic_ns()
        os.write(self._ask, f"{number} {timeout} {path}\n".encode("utf-8", "surrogateescape"))
        while True:
            answered, status, result = self._line().split(b" ", 2)
            if int(answered) == number:  # else: of one that was killed before it was answered
                break
        if status == b"late":
            raise subprocess.TimeoutExpired(command, timeout)
        return subprocess.CompletedProcess(
            command, int(status), bytes.fromhex(result.decode()), b""
        )

    def _line(self) -> bytes:
        line = b""
        while not line.endswith(b"\n"):
            part = os.read(self._answers, 1)
            if not part:
                raise RuntimeError("the worker is gone")
            line += part
        return line[:-1]


def _serve(asked: int, answers: int) -> None:
    from pxr import Sdf, Tf, Usd, UsdUtils  # noqa: F401

    from usdface.io.usd import sandbox_worker

    nowhere = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1, 2):
        os.dup2(nowhere, stream)
    with os.fdopen(asked, "rb") as questions:
        for line in questions:
            number, timeout, path = line[:-1].split(b" ", 2)
            status, result = _opened(sandbox_worker, os.fsdecode(path), float(timeout))
            os.write(answers, b"%s %s %s\n" % (number, status.encode(), result.hex().encode()))
    os._exit(0)


def _opened(sandbox_worker: Any, path: str, timeout: float) -> tuple[str, bytes]:
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        os.dup2(write, 1)
        os.closerange(3, 256)
        sys.stdout = os.fdopen(1, "w", closefd=False)
        sys.argv[1:] = [path]
        status = 1
        try:
            sandbox_worker.main()
            status = 0
        finally:
            os._exit(status)
    os.close(write)
    result, end = b"", time.monotonic() + timeout
    late = False
    while True:
        if not select.select([read], [], [], max(0.0, end - time.monotonic()))[0]:
            os.kill(child, signal.SIGKILL)
            late = True
            break
        part = os.read(read, 65536)
        if not part:
            break
        result += part
    os.close(read)
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    return ("late" if late else str(status)), result


def without_memory(cache: Path) -> None:
    """Forget which files were opened: a spoilt one takes the place of another within a tick."""
    folder = cache / "usdface" / "opened"
    if folder.is_dir():
        for entry in folder.iterdir():
            entry.unlink()
