"""Worker processes that live as long as there is work, each with a pipe of its own.

A worker that dies, or works on a task for longer than the time limit, is replaced; its task has
failed, the others go on. If the process of the caller dies, its workers end with their task.
"""

import multiprocessing
import os
import signal
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from importlib import import_module
from multiprocessing.connection import Connection, wait
from types import ModuleType
from typing import Any

from usdface.errors import UsdFaceError

__all__ = ["Outcome", "cores", "run_in_workers"]

_PATIENCE = 5.0  # s that a worker has to end on request
_starting = threading.Lock()  # one at a time, as the main module is that of the whole process


@dataclass(frozen=True, slots=True)
class Outcome:
    """The outcome of a task.

    Attributes
    ----------
    number : int
        Of the task.
    value : object
        The return value of the function; None if it failed.
    error : str
        Why it failed; "" if it did not.
    code : str
        Of the error: that of a `UsdFaceError`, ``WORKER_DIED``, ``WORKER_HUNG``,
        ``PROGRAM_FAULT``.
    """

    number: int
    value: Any = None
    error: str = ""
    code: str = ""


@dataclass(slots=True)
class _Worker:
    process: Any
    pipe: Connection
    task: int | None = None
    begun: float = 0.0


def cores() -> int:
    """Return how many cores this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # macOS, Windows
        return os.cpu_count() or 1


def run_in_workers(
    function: str,
    tasks: Sequence[Any],
    *,
    workers: int,
    time_limit: float,
    on_begin: Callable[[int], object] = lambda number: None,
) -> Iterator[Outcome]:
    """Call a function with each task, in some processes at once; yield as they are done.

    Parameters
    ----------
    function : str
        ``"package.module:function"``, of one argument that can be pickled, like its value.
    tasks : sequence
    workers : int
        At least 1.
    time_limit : float [s]
        For a task; infinite for none.
    on_begin : callable
        Called with the number of each task that begins.
    """
    waiting = deque(range(len(tasks)))
    team: list[_Worker] = []
    try:
        while waiting or any(worker.task is not None for worker in team):
            while waiting and len(team) < min(workers, len(tasks)):
                team.append(_start(function))
            for worker in team:
                if worker.task is None and waiting:
                    number = waiting.popleft()
                    worker.task, worker.begun = number, time.monotonic()
                    on_begin(number)
                    with suppress(OSError):  # it has died: detected below
                        worker.pipe.send((number, tasks[number]))
            for worker, outcome in _next(team, time_limit):
                yield outcome
                worker.task = None
                if outcome.code in ("WORKER_DIED", "WORKER_HUNG"):
                    _stop(worker)
                    team.remove(worker)
    finally:
        for worker in team:
            if worker.task is None:
                worker.pipe.close()  # it ends by itself
            else:
                worker.process.terminate()
        for worker in team:
            _stop(worker)


def _start(function: str) -> _Worker:
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=_serve, args=(theirs, function), daemon=True)
    with _no_main_module():
        process.start()
    theirs.close()
    return _Worker(process, ours)


@contextmanager
def _no_main_module() -> Iterator[None]:
    """Let a worker start without the caller's script, which it needs nothing of.

    Python would run it again in each worker: all of a script without ``if __name__ == "__main__"``,
    and none can start where the script is no file, as one that is piped to Python.
    """
    with _starting:
        main = sys.modules["__main__"]
        sys.modules["__main__"] = ModuleType("__main__")
        try:
            yield
        finally:
            sys.modules["__main__"] = main


def _next(team: list[_Worker], time_limit: float) -> list[tuple[_Worker, Outcome]]:
    """Wait until a worker is done, has died or is late; return these with their outcomes."""
    busy = [worker for worker in team if worker.task is not None]
    now = time.monotonic()
    patience = min(worker.begun + time_limit - now for worker in busy)
    watched = [handle for w in busy for handle in (w.pipe, w.process.sentinel)]
    wait(watched, None if patience == float("inf") else max(0.0, patience))
    found = []
    for worker in busy:
        assert worker.task is not None
        if (outcome := _received(worker)) is not None:
            found.append((worker, outcome))
        elif not worker.process.is_alive():
            worker.process.join()
            why = _cause(worker.process.exitcode)
            found.append((worker, Outcome(worker.task, None, why, "WORKER_DIED")))
        elif time.monotonic() - worker.begun >= time_limit:
            worker.process.kill()
            why = f"it takes longer than {time_limit:g} s and was ended; --time-limit allows more"
            found.append((worker, Outcome(worker.task, None, why, "WORKER_HUNG")))
    return found


def _received(worker: _Worker) -> Outcome | None:
    """Return the outcome that a worker has sent, even if it died since; None without one."""
    with suppress(EOFError, OSError):
        if worker.pipe.poll():
            outcome: Outcome = worker.pipe.recv()
            return outcome
    return None


def _cause(status: int | None) -> str:
    if status is not None and status < 0:
        with suppress(ValueError):
            return f"the worker process was ended by {signal.Signals(-status).name}"
    return f"the worker process ended with status {status}"


def _stop(worker: _Worker) -> None:
    worker.process.join(0.0 if worker.task is None else _PATIENCE)
    if worker.process.is_alive():
        worker.process.join(_PATIENCE)
    if worker.process.is_alive():
        worker.process.kill()
        worker.process.join()
    worker.pipe.close()


def _serve(pipe: Connection, function: str) -> None:
    """Work: the process of a worker."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # of the terminal, to all: the caller decides
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    with suppress(OSError):
        os.dup2(2, 1)  # standard output is the caller's report
    module, _, name = function.partition(":")
    call = getattr(import_module(module), name)
    while True:
        try:
            number, task = pipe.recv()
        except (EOFError, OSError):
            return
        outcome = _done(call, number, task)
        try:
            pipe.send(outcome)
        except OSError:  # the caller is gone
            return


def _done(call: Callable[[Any], Any], number: int, task: Any) -> Outcome:
    try:
        return Outcome(number, call(task))
    except UsdFaceError as error:
        return Outcome(number, None, str(error), error.code)
    except MemoryError:
        return Outcome(number, None, "there is not enough memory for this", "TOO_LARGE")
    except Exception as error:  # a mistake in usdface fails one shot, not the others
        return Outcome(number, None, f"{type(error).__name__}: {error}", "PROGRAM_FAULT")
