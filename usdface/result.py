"""The result of a job: the value made, files written, findings, figures, times."""

import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic, TypeVar

from usdface.findings import Finding
from usdface.short_repr import short_repr
from usdface.verdict.judge import Verdict

__all__ = ["Result", "peak_memory"]

ValueT = TypeVar("ValueT")


@dataclass(frozen=True, slots=True)
class Result(Generic[ValueT]):
    """The result of a job.

    Attributes
    ----------
    value : ValueT
        The value that the job is there for: a `ShotResult` of `process`, the `RetargetSetup` of
        `make_shot`, ...; None of a job that only writes.
    written : tuple of Path
        Files that were written, the one to open first.
    findings : tuple of Finding
    summary : mapping of str to value
        Numbers and names under stable keys; a key ends in its unit (``residual_mean_mm``).
    details : mapping of str to value
        The same, too long for a screen: residual of each frame, deviation of each weight.
    seconds : mapping of str to float [s]
        Time of each step.
    verdict : Verdict or None
        Of a job that retargets a shot: good, look at, or not usable.

    Examples
    --------
    >>> result = usdface.make_take("examples/performance.trc", "take.usdc")
    >>> result.value.rate == result.summary["rate_hz"]
    True
    >>> [path.name for path in result.written]
    ['take.usdc']
    """

    __repr__ = short_repr

    value: ValueT
    written: tuple[Path, ...] = ()
    findings: tuple[Finding, ...] = ()
    summary: dict[str, Any] = field(default_factory=dict)
    details: dict[str, Any] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)
    verdict: Verdict | None = None

    def as_dict(self) -> dict[str, Any]:
        """Return all but the value as plain values for JSON."""
        return {
            "written": [str(path) for path in self.written],
            "findings": [finding.as_dict() for finding in self.findings],
            **({"verdict": self.verdict.as_dict()} if self.verdict else {}),
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
