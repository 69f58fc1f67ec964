"""The verdict: measures against the criteria, the most serious reasons first."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from usdface.errors import SolveError
from usdface.verdict.criteria import CRITERIA, Criterion

__all__ = ["Level", "Measured", "Reason", "Verdict", "judge", "refuse_unusable", "verdict_from"]

Level = Literal["good", "look_at", "not_usable"]

_REASONS = 3
_KINDS = ("markers", "shapes", "curves", "regions", "size", "length")


@dataclass(frozen=True, slots=True)
class Measured:
    """A measure: its value, and the markers, shapes or frames that it comes from.

    Attributes
    ----------
    value : float
    kind : str
        Kind of the names in `where`: ``"markers"``, ``"shapes"``, ``"curves"``, ``"regions"``,
        ``"size"``, ``"length"``.
    where : tuple of str
    frames : tuple of int
        First and last frame index; () = the whole take.
    seconds : tuple of float [s]
        The times of `frames`.
    """

    value: float
    kind: str = ""
    where: tuple[str, ...] = ()
    frames: tuple[int, ...] = ()
    seconds: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class Reason:
    """A reason of a verdict.

    Attributes
    ----------
    criterion : Criterion
    measured : Measured
        At or beyond a limit of the criterion.
    """

    criterion: Criterion
    measured: Measured

    @property
    def level(self) -> Level:
        """``"look_at"`` or ``"not_usable"``."""
        beyond = self.measured.value >= self.criterion.not_usable
        return "not_usable" if beyond else "look_at"

    @property
    def message(self) -> str:
        """The defect, in a line."""
        share = not self.criterion.unit
        value = f"{self.measured.value:.0%}" if share else f"{self.measured.value:.2g}"
        return self.criterion.subject.format(value=value, where=self._where)

    @property
    def _where(self) -> str:
        names = ", ".join(self.measured.where)
        if not self.measured.frames:
            return names
        first, last = self.measured.frames[0], self.measured.frames[-1]
        return f"frames {first} to {last}: {names}"

    def as_dict(self) -> dict[str, Any]:
        """Return the reason as plain values."""
        limit = self.criterion.not_usable
        place = {self.measured.kind: list(self.measured.where)} if self.measured.kind else {}
        frames = {"frames": list(self.measured.frames)} if self.measured.frames else {}
        times = [round(time, 4) for time in self.measured.seconds]
        return {
            "code": self.criterion.code,
            "level": self.level,
            "value": round(self.measured.value, 4),
            "unit": self.criterion.unit,
            "look_at_from": self.criterion.look_at,
            "not_usable_from": None if np.isinf(limit) else limit,
            **place,
            **frames,
            **({"seconds": times} if times else {}),
        }


@dataclass(frozen=True, slots=True)
class Verdict:
    """The verdict on a result.

    Attributes
    ----------
    level : {"good", "look_at", "not_usable"}
    reasons : tuple of Reason
        At most three, the most serious first; none of a good result.

    Examples
    --------
    >>> result = usdface.process("examples/shot.usda")
    >>> result.verdict.level
    'good'
    """

    level: Level
    reasons: tuple[Reason, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """Return the verdict as plain values for a JSON report."""
        return {"level": self.level, "reasons": [reason.as_dict() for reason in self.reasons]}


def judge(measured: Mapping[str, Measured]) -> Verdict:
    """Judge a result by its measures.

    Parameters
    ----------
    measured : mapping of str to Measured
        By the code of their criterion; criteria without a measure are skipped.
    """
    reasons = [
        Reason(criterion, measured[criterion.code])
        for criterion in CRITERIA
        if criterion.code in measured and measured[criterion.code].value >= criterion.look_at
    ]
    if not reasons:
        return Verdict("good")
    ranked = sorted(reasons, key=_weight, reverse=True)
    return Verdict(ranked[0].level, tuple(ranked[:_REASONS]))


def _weight(reason: Reason) -> tuple[bool, float]:
    """Return the sort key of a reason: its level, then the ratio to its limit."""
    fatal = reason.level == "not_usable"
    limit = reason.criterion.not_usable if fatal else reason.criterion.look_at
    return fatal, reason.measured.value / limit


def refuse_unusable(verdict: Verdict | None) -> None:
    """Raise the error of a result that is not usable, or has no verdict.

    Raises
    ------
    SolveError
        With the most serious reason and its remedy.
    """
    if verdict is None:
        raise SolveError(
            "the result has no verdict (ADVICE_FAILED) and nothing is written; process without "
            "--strict to look at it",
            "RESULT_UNUSABLE",
        )
    if verdict.level == "not_usable":
        reason = verdict.reasons[0]
        raise SolveError(
            f"the result is not usable and nothing is written: {reason.message}; "
            f"{reason.criterion.remedy}",
            "RESULT_UNUSABLE",
        )


def verdict_from(plain: object) -> Verdict | None:
    """Read a verdict from the output of `Verdict.as_dict`; None if `plain` is not one.

    Parameters
    ----------
    plain : object
        Any content, as of an untrusted file, or of a version with other criteria. The level
        follows from the values; a verdict whose reasons are none is not read as good.
    """
    try:
        level, listed = plain["level"], plain["reasons"]  # type: ignore[index]
        measured = {str(reason["code"]): _measured(reason) for reason in listed[:_REASONS]}
    except (KeyError, TypeError, ValueError, OverflowError):
        return None
    verdict = judge(measured)
    return None if len(verdict.reasons) < len(measured) or _is_lost(level, verdict) else verdict


def _is_lost(level: object, verdict: Verdict) -> bool:
    return verdict.level == "good" and level != "good"


def _measured(reason: Mapping[str, Any]) -> Measured:
    kind = next((kind for kind in _KINDS if kind in reason), "")
    where = tuple(str(name) for name in reason.get(kind, ()))
    frames = tuple(int(frame) for frame in reason.get("frames", ()))
    seconds = tuple(float(time) for time in reason.get("seconds", ()))
    return Measured(float(reason["value"]), kind, where, frames, seconds)
