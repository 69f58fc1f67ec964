"""Progress of a job: the step that runs, how much of it is done, and a way to cancel."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

__all__ = ["COMPILE", "OnProgress", "Progress", "Step"]

# The step in which the inner loops are compiled, once for an installation.
COMPILE = "compile the solver (once)"


@dataclass(frozen=True, slots=True)
class Step:
    """The step that a job is at.

    Attributes
    ----------
    name : str
        ``"read"``, ``"clean"``, ``"solve"``, ``"express"``, ``"write"``, ...
    fraction : float or None
        How much of it is done, 0 to 1; None where that is not known beforehand.

    Examples
    --------
    >>> def announce(step: usdface.Step) -> None:
    ...     print(step.name)
    >>> _ = usdface.check("examples/head.usdc", on_progress=announce)
    check
    check head.usdc
    """

    name: str
    fraction: float | None = None


OnProgress = Callable[[Step], object]


class Progress:
    """Announces the steps of a job to a callback, and takes the time of each.

    Every public function takes the callback as `on_progress`. An exception that it raises ends the
    job: nothing has been written or authored then, because writing is the last step and is not
    interrupted. `usdface.Cancelled` is there to be raised.

    Attributes
    ----------
    seconds : dict of str to float [s]
        Time of each step so far.
    """

    def __init__(self, on_progress: OnProgress | None = None) -> None:
        self.seconds: dict[str, float] = {}
        self._on_progress = on_progress
        self._running: list[str] = []

    @classmethod
    def of(cls, on_progress: "OnProgress | Progress | None") -> "Progress":
        """Return the progress of the job that a function is part of, or one of its own."""
        return on_progress if isinstance(on_progress, Progress) else cls(on_progress)

    def __call__(self, step: Step) -> None:
        """Announce how far the job is."""
        if self._on_progress:
            self._on_progress(step)

    @contextmanager
    def step(self, name: str) -> Iterator[None]:
        """Announce a block as the step `name`, and take its time.

        That of a step within a step counts for the inner one alone, after which the outer one is
        announced again.
        """
        self._running.append(name)
        begin = time.perf_counter()
        try:
            self(Step(name))
            yield
        finally:
            taken = time.perf_counter() - begin
            self._running.pop()
            self.seconds[name] = self.seconds.get(name, 0.0) + taken
            if self._running:
                outer = self._running[-1]
                self.seconds[outer] = self.seconds.get(outer, 0.0) - taken
        if self._running:
            self(Step(self._running[-1]))
