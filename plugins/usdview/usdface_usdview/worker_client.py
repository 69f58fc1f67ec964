"""The worker as usdview sees it: requests out, answers in, nothing waits."""

import json
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pxr.Usdviewq.qt import QtCore

__all__ = ["WorkerClient"]

Answer = Callable[[Any], object]


class WorkerClient(QtCore.QObject):
    """A worker process, started with the first request and again after it was ended.

    Signals
    -------
    step(str, float)
        The step of the running job and how much of it is done; -1 = not known.
    failed(str, str)
        An error in one line, and its code.
    busy(bool)
    """

    step = QtCore.Signal(str, float)
    failed = QtCore.Signal(str, str)
    busy = QtCore.Signal(bool)

    def __init__(self, parent: Any = None) -> None:
        super().__init__(parent)
        self._process: Any = None
        self._number = 0
        self._waiting: dict[int, Answer] = {}
        self._unread = b""

    @property
    def running(self) -> bool:
        """Whether a request has no answer yet."""
        return bool(self._waiting)

    def ask(self, job: str, answer: Answer, **request: Any) -> None:
        """Send a request; `answer` gets its result."""
        self._number += 1
        self._waiting[self._number] = answer
        if self._process is None:
            self._start()
        if self._process is None:  # it did not start, which has been said
            return
        line = json.dumps({"id": self._number, "job": job, **request}) + "\n"
        self._process.write(line.encode("utf-8"))
        self.busy.emit(True)

    def end(self) -> None:
        """End the worker; requests without an answer are dropped without a word."""
        self._waiting.clear()
        if self._process is not None:
            process, self._process = self._process, None
            process.finished.disconnect(self._ended)
            process.kill()
            process.waitForFinished(2000)
        self._unread = b""
        self.busy.emit(False)

    def _start(self) -> None:
        process = QtCore.QProcess(self)
        process.setProcessChannelMode(QtCore.QProcess.ForwardedErrorChannel)
        environment = QtCore.QProcessEnvironment.systemEnvironment()
        ours = str(Path(__file__).parents[1])
        paths = [ours, *(each for each in sys.path if each and each != ours)]
        environment.insert("PYTHONPATH", os.pathsep.join(paths))
        process.setProcessEnvironment(environment)
        process.readyReadStandardOutput.connect(self._read)
        process.finished.connect(self._ended)
        process.errorOccurred.connect(self._not_started)
        # In some builds of usdview sys.executable is no Python
        python = os.environ.get("USDFACE_PYTHON", sys.executable)
        self._process = process  # before it starts, which may fail at once
        process.start(python, ["-m", "usdface_usdview.worker"])

    def _read(self) -> None:
        if self._process is None:
            return
        self._unread += bytes(self._process.readAllStandardOutput())
        *lines, self._unread = self._unread.split(b"\n")
        for line in lines:
            self._take(json.loads(line))

    def _take(self, said: dict[str, Any]) -> None:
        if "step" in said:
            name, fraction = said["step"]
            self.step.emit(name, -1.0 if fraction is None else fraction)
            return
        answer = self._waiting.pop(said["id"], None)
        if not self._waiting:
            self.busy.emit(False)
        if "error" in said:
            self.failed.emit(said["error"], said["code"])
        elif answer is not None:
            answer(said["result"])

    def _not_started(self, error: Any) -> None:
        if error == QtCore.QProcess.FailedToStart:
            self._ended()

    def _ended(self, *_: Any) -> None:
        """Say that the worker died: by the system, by a user, for want of memory."""
        self._process, self._unread = None, b""
        lost = bool(self._waiting)
        self._waiting.clear()
        self.busy.emit(False)
        if lost:
            self.failed.emit(
                "the worker process ended before it answered; the stage is as it was. Process "
                "starts a new one",
                "WORKER_ENDED",
            )
