"""Errors of linear algebra as our own."""

from collections.abc import Iterator
from contextlib import contextmanager

from numpy.linalg import LinAlgError

from usdface.errors import SolveError

__all__ = ["solve_errors"]


@contextmanager
def solve_errors() -> Iterator[None]:
    """Run a block, or as a decorator a function; numbers that determine nothing are a SolveError.

    Raises
    ------
    SolveError
        If a matrix is singular or not positive definite.
    """
    try:
        yield
    except LinAlgError as error:
        raise SolveError(
            f"the numbers do not determine a solution ({error}); are there markers or vertices "
            "far off? `usdface check` finds vertices"
        ) from error
