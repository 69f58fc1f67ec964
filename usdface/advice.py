"""What only advises ends no job: where it fails, that is a finding."""

from collections.abc import Callable
from contextvars import ContextVar
from typing import TypeVar

import numpy as np

from usdface.findings import Finding, finding

__all__ = ["RAISING", "advice"]

# True: advice that fails raises its error after all, as the tests of this package want it.
RAISING: ContextVar[bool] = ContextVar("RAISING", default=False)
_LONGEST = 200

_Answer = TypeVar("_Answer")


def advice(
    what: str, give: Callable[[], _Answer], otherwise: _Answer
) -> tuple[_Answer, list[Finding]]:
    """Return some advice, or the finding ADVICE_FAILED.

    Numbers that overflow or are none count as a failure: advice is sound or not given.

    Parameters
    ----------
    what : str
        What it is about, in a few words.
    give : callable
        Returns it. How long that takes and how much memory is bounded by the size of the data.
    otherwise
        Stands for it where `give` raises.
    """
    try:
        with np.errstate(over="raise", divide="raise", invalid="raise"):
            return give(), []
    except Exception as error:  # of any kind: the job does not depend on it
        if RAISING.get():
            raise
        why = " ".join(f"{type(error).__name__}: {error}".split())[:_LONGEST]
        message = f"left out, and nothing else depends on it ({why})"
        return otherwise, [finding("ADVICE_FAILED", what, message)]
