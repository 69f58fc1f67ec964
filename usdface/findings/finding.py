"""A finding: its code, place, message and values."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from usdface.errors import did_you_mean
from usdface.findings.codes import CODES, Action, Severity
from usdface.findings.values import filled_in, plain_values
from usdface.frozen_mapping import FrozenMapping
from usdface.plain_text import plain

__all__ = ["Finding", "finding", "severest", "timed"]

_LONGEST, _LONGEST_PLACE = 800, 400  # characters


@dataclass(frozen=True, slots=True)
class Finding:
    """A recoverable loss, guess or fault.

    Attributes
    ----------
    code : str
        A key of `CODES`.
    where : str
        File, prim path, marker, shape or frame range that it concerns.
    message : str
        One line, for people.
    severity : {"info", "warning", "error"}
    values : mapping of str to value
        The numbers and names of the message under stable keys, which end in their unit
        (docs/reports.md).

    Examples
    --------
    >>> _, findings = usdface.read_take("examples/performance.trc")
    >>> all(finding.severity in ("info", "warning", "error") for finding in findings)
    True
    """

    code: str
    where: str
    message: str
    severity: Severity
    values: Mapping[str, Any] = field(default_factory=dict, hash=False)

    def __post_init__(self) -> None:
        """Escape and shorten text that came from a file."""
        object.__setattr__(self, "values", FrozenMapping(plain_values(self.values)))
        object.__setattr__(self, "where", plain(self.where, _LONGEST_PLACE))
        object.__setattr__(self, "message", plain(self.message, _LONGEST))

    @property
    def action(self) -> Action:
        """The remedy; ``"nothing"`` where it only informs."""
        return CODES[self.code][1]

    def as_dict(self) -> dict[str, Any]:
        """Return the finding as plain values for a JSON report, without its prose."""
        return {
            "code": self.code,
            "severity": self.severity,
            "action": self.action,
            "where": self.where,
            "values": dict(self.values),
        }


def finding(code: str, where: str, message: str = "", *values: object, **more: object) -> Finding:
    """Make a finding of a known code; the table gives severity and default message.

    Parameters
    ----------
    code : str
        A key of `CODES`.
    where : str
        The thing it is about: a marker, blend shape, prim path or file.
    message : str
        One line, in place of the default. With `values`, a template: ``{distance_mm:.1f}`` is the
        place of a value, and its key.
    values
        The values of the template, in the order of their keys.
    more
        Values that the message does not show.

    Returns
    -------
    Finding

    Raises
    ------
    KeyError
        If `code` is not in `CODES` (a mistake in the program, not in its input).
    ValueError
        If the template has another number of keys (likewise).

    Examples
    --------
    >>> occluded = "occluded in {occluded_count} of {frame_count} frames"
    >>> found = usdface.finding("MARKER_OCCLUDED", "chin", occluded, 3, 9)
    >>> found.severity, found.message
    ('info', 'occluded in 3 of 9 frames')
    >>> dict(found.values)
    {'occluded_count': 3, 'frame_count': 9}
    """
    if code not in CODES:
        raise KeyError(f"no finding has the code {code!r}{did_you_mean(str(code), CODES)}")
    severity, _, default = CODES[code]
    text, named = filled_in(message, values) if values else (message, {})
    return Finding(code, where, text or default, severity, {**named, **more})


def severest(findings: Iterable[Finding]) -> Severity:
    """Return the highest severity among `findings`; "info" when there are none."""
    order: tuple[Severity, ...] = ("info", "warning", "error")
    return max((f.severity for f in findings), key=order.index, default="info")


# Frame indices among the values of a finding, and the key of their time.
_CLOCK = {
    "frame": "time_s",
    "frames": "times_s",
    "first_frame": "start_s",
    "last_frame": "end_s",
}


def timed(findings: Iterable[Finding], times: Sequence[float]) -> tuple[Finding, ...]:
    """Return findings whose frames have their times beside them.

    Parameters
    ----------
    findings : iterable of Finding
    times : sequence of float
        The time of each frame of the take [s].
    """
    return tuple(replace(each, values={**each.values, **_times(each, times)}) for each in findings)


def _times(found: Finding, times: Sequence[float]) -> dict[str, Any]:
    def at(frame: Any) -> Any:
        if isinstance(frame, list):
            return [at(each) for each in frame]
        return times[frame] if 0 <= frame < len(times) else None

    return {key: at(found.values[name]) for name, key in _CLOCK.items() if name in found.values}
