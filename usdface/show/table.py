"""The table of a sequence: a row for each shot, the ones in most trouble first."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from typing import Any, Literal

from usdface.findings import Finding, finding
from usdface.findings.values import Prose

__all__ = ["Row", "State", "by_trouble", "findings_of", "row_from", "summary_of"]

State = Literal["processed", "kept", "failed", "missing"]
_TROUBLE = {"good": 1, "look_at": 2, "not_usable": 3}


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """A shot in the table.

    Attributes
    ----------
    name : str
    state : {"processed", "kept", "failed", "missing"}
        "kept": the result of an earlier run is up to date. "missing": not processed yet, and only a
        table was requested.
    error, code : str
        Why it failed.
    verdict : str
        ``"good"``, ``"look_at"``, ``"not_usable"``; "" = none.
    reasons : tuple of str
        Codes of the verdict's reasons.
    frames : int
    residual_mean_mm, residual_max_mm : float or None
        None of a take of weights.
    occluded_share : float or None
        Of all places of all used markers.
    correction_max : float or None
        Largest change of a weight by the expression layer.
    findings : mapping of str to int
        How many of each code, without those that only inform.
    notes : int
        Findings that only inform.
    stages : mapping of str to str
        "computed" or "cached" for each stage, solve and express; none where nothing is kept.
    seconds : float
        Of processing.
    peak_memory_mb : float
        Of the worker so far.
    root, page : str
        The file to open, the page to look at; "" = none.
    written : tuple of str
    """

    name: str
    state: State = "processed"
    error: str = ""
    code: str = ""
    verdict: str = ""
    reasons: tuple[str, ...] = ()
    frames: int = 0
    residual_mean_mm: float | None = None
    residual_max_mm: float | None = None
    occluded_share: float | None = None
    correction_max: float | None = None
    findings: Mapping[str, int] = field(default_factory=dict)
    notes: int = 0
    stages: Mapping[str, str] = field(default_factory=dict)
    seconds: float = 0.0
    peak_memory_mb: float = 0.0
    root: str = ""
    page: str = ""
    written: tuple[str, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """Return the row as plain values."""
        return asdict(self)


def row_from(plain: Mapping[str, Any]) -> Row | None:
    """Return the row that `Row.as_dict` gave, or None if `plain` is none."""
    kinds: dict[str, Any] = {
        **dict.fromkeys(("name", "state", "error", "code", "verdict", "root", "page"), str),
        **dict.fromkeys(("reasons", "written"), list | tuple),
        **dict.fromkeys(("findings", "stages"), dict),
        **dict.fromkeys(("frames", "notes"), int),
        **dict.fromkeys(("seconds", "peak_memory_mb"), int | float),
    }
    known = {part.name for part in fields(Row)}
    if set(plain) != known:
        return None
    for name, value in plain.items():
        if not isinstance(value, kinds.get(name, int | float | None)):
            return None
    lists = {name: tuple(map(str, plain[name])) for name in ("reasons", "written")}
    return Row(**{**plain, **lists})


def by_trouble(rows: Iterable[Row]) -> list[Row]:
    """Return rows sorted: failed, missing, then by verdict, worst residual and correction."""
    return sorted(rows, key=_trouble)


def _trouble(row: Row) -> tuple[Any, ...]:
    lost = {"failed": 2, "missing": 1}.get(row.state, 0)
    return (
        -lost,
        -_TROUBLE.get(row.verdict, 0),
        -(row.residual_max_mm or 0.0),
        -(row.occluded_share or 0.0),
        -(row.correction_max or 0.0),
        row.name,
    )


def findings_of(rows: Iterable[Row]) -> Iterator[Finding]:
    """Yield a finding for each row of a shot that failed, or whose result is missing."""
    for row in rows:
        if row.state == "failed":
            yield finding(
                "SHOT_FAILED", row.name, "{message} [{error}]", Prose(row.error), row.code
            )
        elif row.state == "missing":
            yield finding("SHOT_MISSING", row.name, row.error)


def summary_of(rows: Sequence[Row], workers: int) -> dict[str, Any]:
    """Return the summary of a sequence that some worker processes ran."""
    states = Counter(row.state for row in rows)
    verdicts = Counter(row.verdict for row in rows if row.verdict)
    return {
        "shots": len(rows),
        **{state: states[state] for state in ("processed", "kept", "failed", "missing")},
        "verdicts": {name: verdicts[name] for name in ("good", "look_at", "not_usable")},
        "workers": workers,
        "peak_memory_mb": max((row.peak_memory_mb for row in rows), default=0.0),
    }
