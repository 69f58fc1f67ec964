"""Advice beside a result ends no job: where it fails, that is a finding."""

from collections.abc import Callable
from contextvars import ContextVar
from typing import TypeVar

import numpy as np

from usdface.findings import Finding, finding
from usdface.findings.values import Prose
from usdface.plain_text import error_line

__all__ = ["RAISING", "advice"]

# True: advice that fails raises its error, as in the tests of this package.
RAISING: ContextVar[bool] = ContextVar("RAISING", default=False)
# Characters of an error in the finding: a line or two of a terminal.
_LONGEST = 200

_Answer = TypeVar("_Answer")


def advice(
    name: str, give: Callable[[], _Answer], otherwise: _Answer
) -> tuple[_Answer, list[Finding]]:
    """Return some advice, or a replacement and the finding ADVICE_FAILED.

    Floating-point overflow, division by zero and NaN count as a failure: advice is sound or not
    given.

    Parameters
    ----------
    name : str
        Its subject in a few words, for the finding.
    give : callable
        Returns the advice. Its time and memory are bounded by the size of the data.
    otherwise
        Replaces the advice where `give` raises.

    Returns
    -------
    advice
    list of Finding
        ADVICE_FAILED, or none.
    """
    try:
        with np.errstate(over="raise", divide="raise", invalid="raise"):
            return give(), []
    except Exception as error:  # of any kind: the job does not depend on it
        if RAISING.get():
            raise
        why = error_line(error)[:_LONGEST]
        message = "left out, and nothing else depends on it ({why})"
        return otherwise, [finding("ADVICE_FAILED", name, message, Prose(why))]
