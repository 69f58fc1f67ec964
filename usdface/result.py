"""What a command has to say for itself: files, findings, figures, time."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from usdface.findings import Finding

__all__ = ["COMPILE", "OnStep", "Result", "Steps"]

# The step in which the inner loops are compiled, once for an installation.
COMPILE = "compile the solver (once)"

OnStep = Callable[[str], None]


class Steps:
    """Times the named steps of a command and tells a listener when each begins.

    The time of a step within a step counts for the inner one alone, after which the outer one is
    announced again.
    """

    def __init__(self, on_step: OnStep | None = None) -> None:
        self.seconds: dict[str, float] = {}
        self._on_step = on_step
        self._running: list[str] = []

    @contextmanager
    def __call__(self, name: str) -> Iterator[None]:
        """Time a block [s], as the step `name`."""
        self._running.append(name)
        self._announce()
        begin = time.perf_counter()
        try:
            yield
        finally:
            taken = time.perf_counter() - begin
            self._running.pop()
            self.seconds[name] = self.seconds.get(name, 0.0) + taken
            if self._running:
                outer = self._running[-1]
                self.seconds[outer] = self.seconds.get(outer, 0.0) - taken
                self._announce()

    def _announce(self) -> None:
        if self._on_step:
            self._on_step(self._running[-1])


@dataclass(frozen=True, slots=True)
class Result:
    """The result of a command.

    Attributes
    ----------
    written : tuple of Path
        Files that were written, the one to open first.
    findings : tuple of Finding
    summary : mapping of str to value
        Figures for people and reports, each name with its unit.
    seconds : mapping of str to float [s]
        Time of each step.
    details : mapping of str to value
        What is too long for the screen, for reports only.
    """

    written: tuple[Path, ...] = ()
    findings: tuple[Finding, ...] = ()
    summary: dict[str, Any] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)
    details: dict[str, Any] = field(default_factory=dict)

    def as_dict(self) -> dict[str, Any]:
        """Return the outcome as plain values for JSON."""
        return {
            "written": [str(path) for path in self.written],
            "findings": [finding.as_dict() for finding in self.findings],
            "summary": self.summary,
            **self.details,
            "seconds": {name: round(value, 3) for name, value in self.seconds.items()},
            "peak_memory_mb": round(peak_memory() / 1e6, 1),
        }


def peak_memory() -> int:
    """Return the peak resident memory of this process [bytes]; 0 where it is unknown."""
    try:
        import resource
    except ImportError:  # Windows
        return 0
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit
