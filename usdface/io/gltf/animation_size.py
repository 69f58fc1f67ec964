"""How large the animation of a file may become in memory."""

from usdface.errors import InputError

__all__ = ["check_size"]

_MOST_NUMBERS = 2**27  # in the curves of one animation, 1 GiB


def check_size(numbers: int, subject: str) -> None:
    """Refuse a small file that unfolds into huge curves, before they are allocated.

    Raises
    ------
    InputError
        If there are too many numbers.
    """
    if numbers > _MOST_NUMBERS:
        message = f"{subject} unfolds into more than {_MOST_NUMBERS} numbers; split it"
        raise InputError(message, "TOO_LARGE")
