"""Commands of usdface, run one after the other in processes of their own."""

import json
import os
import subprocess
import sys
import threading
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from queue import Empty, SimpleQueue

_SECONDS_TO_END = 3.0
_LONGEST = 400  # characters of a message


@dataclass(frozen=True)
class Command:
    """A command of usdface: its words, and a name for the progress bar."""

    label: str
    words: tuple[str, ...]


class Worker:
    """Runs commands without stopping Blender: ask `poll` now and then.

    Attributes
    ----------
    progress : float
        Of the running command, 0 to 1.
    step : str
        The step that it is at.
    answers : list of dict
        What each command that is done printed, parsed.
    error : str
        Why the commands ended before the last; "" while they run, and if all are done.
    """

    def __init__(self, commands: list[Command]) -> None:
        self.progress, self.step, self.error = 0.0, "", ""
        self.answers: list[dict] = []
        self._waiting = list(commands)
        self._count = len(commands)
        self._label = ""
        self._process: subprocess.Popen | None = None
        self._lines: SimpleQueue[str] = SimpleQueue()
        self._threads: list[threading.Thread] = []
        self._output, self._other = "", []

    @property
    def process_id(self) -> int:
        """The process that runs; 0 if none does."""
        return self._process.pid if self._process else 0

    def poll(self) -> bool:
        """Take what the running process said, and start the next; False when all is over."""
        self._read_lines()
        if self._process is not None and self._process.poll() is not None:
            self._finish()
        if self._process is None and not self.error and self._waiting:
            self._start(self._waiting.pop(0))
        return self._process is not None

    def wait(self, sleep: Callable[[float], None]) -> None:
        """Poll until all is over."""
        while self.poll():
            sleep(0.05)

    def cancel(self) -> None:
        """End the running process; nothing of it is half-written."""
        self._waiting, self.error = [], "cancelled"
        if self._process is not None:
            self._process.terminate()
            try:
                self._process.wait(_SECONDS_TO_END)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
            self._process = None

    def _start(self, command: Command) -> None:
        self._label, self._output, self._other = command.label, "", []
        self.step = command.label
        try:
            self._process = subprocess.Popen(
                [python(), "-m", "usdface", *command.words],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
                encoding="utf-8",
                env=environment(),
                creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),  # no console on Windows
            )
        except OSError as error:
            self.error = f"cannot start {command.label}: {error}"
            return
        self._threads = [
            threading.Thread(target=self._listen, args=(self._process.stderr,), daemon=True),
            threading.Thread(target=self._collect, args=(self._process.stdout,), daemon=True),
        ]
        for thread in self._threads:
            thread.start()

    def _listen(self, stream) -> None:
        for line in stream:
            self._lines.put(line)

    def _collect(self, stream) -> None:
        self._output = stream.read()

    def _read_lines(self) -> None:
        while True:
            try:
                line = self._lines.get_nowait()
            except Empty:
                return
            try:
                said = json.loads(line)
                self.step = f"{self._label}: {said['step']}"
                done = (len(self.answers) + (said["fraction"] or 0.0)) / self._count
                self.progress = max(self.progress, done)  # a step may begin again
            except (ValueError, KeyError, TypeError):
                self._other.append(line.strip())

    def _finish(self) -> None:
        for thread in self._threads:
            thread.join()
        self._read_lines()
        status, self._process = self._process.returncode, None
        try:
            answer = json.loads(self._output)
        except ValueError:
            answer = {}
        if status == 0:
            self.answers.append(answer)
            return
        self._waiting = []
        self.error = self._reason(status, answer)
        if isinstance(answer, dict) and "markers" in answer:  # places that are unsure
            self.answers.append(answer)

    def _reason(self, status: int, answer: dict) -> str:
        if isinstance(answer, dict) and "error" in answer:
            return answer["error"]["message"]
        if status < 0:
            return f"`usdface {self._label}` was ended from outside (signal {-status})"
        told = [line.removeprefix("usdface: ") for line in self._other if line]
        return (told[-1] if told else f"`usdface {self._label}` ended with status {status}")[
            :_LONGEST
        ]


def python() -> str:
    """Return the Python of Blender."""
    return sys.executable


def environment() -> dict[str, str]:
    """Return the environment of a worker: the modules that this process would load."""
    folders = []
    for name in ("usdface", "scipy", "numpy", "pxr"):
        package = find_spec(name)
        if package is not None and package.submodule_search_locations:
            folders.append(str(Path(next(iter(package.submodule_search_locations))).parent))
    places = os.pathsep.join(dict.fromkeys(folders))
    return {**os.environ, "PYTHONPATH": places, "PYTHONNOUSERSITE": "1", "PYTHONUTF8": "1"}
