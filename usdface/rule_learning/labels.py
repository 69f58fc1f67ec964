"""Labels: stretches of takes with their emotions."""

from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Literal

from usdface.errors import InputError
from usdface.fuzzy.rule_parser import KEYWORDS

__all__ = ["NEUTRAL", "NOTHING", "Label"]

# The neutral face: the take's neutral, and no emotion.
NEUTRAL = "neutral"
# Speech and other movement without emotion.
NOTHING = "none"


@dataclass(frozen=True, slots=True)
class Label:
    """One labelled stretch.

    Attributes
    ----------
    take : Path
        File of the recording.
    start, end : float
        First and last moment, inclusive: frame indices of the take, or seconds.
    unit : {"frame", "s"}
        Of `start` and `end`.
    emotion : str
        Any name that is legal in a rule; `NEUTRAL` and `NOTHING` are no emotions.
    variant : str
        One of several ways to show it; "" = not distinguished.
    intensity : float
        In (0, 1].

    Raises
    ------
    InputError
        If the stretch ends before it begins, or a value cannot be used.
    """

    take: Path
    start: float
    end: float
    unit: Literal["frame", "s"]
    emotion: str
    variant: str = ""
    intensity: float = 1.0

    def __post_init__(self) -> None:
        if not (isfinite(self.end) and 0 <= self.start <= self.end):
            raise InputError(
                f"the stretch from {self.start:g} to {self.end:g}; expected a start of 0 or later, "
                "and an end that is not before it"
            )
        if not 0 < self.intensity <= 1:
            raise InputError(f"intensity {self.intensity:g}; expected above 0 and at most 1")
        if not self.emotion.isidentifier() or self.emotion.upper() in KEYWORDS:
            raise InputError(
                f"emotion {self.emotion!r}; expected one word of letters, digits and _, and none "
                f"of {', '.join(KEYWORDS)}"
            )

    @property
    def is_emotion(self) -> bool:
        """Whether the label is an emotion."""
        return self.emotion not in (NEUTRAL, NOTHING)
