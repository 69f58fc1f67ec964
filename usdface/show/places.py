"""Places in a list that a manager of a farm names by integers."""

from usdface.errors import InputError

__all__ = ["places"]


def places(index: str, count: int, option: str, things: str) -> range:
    """Return the places that ``"N"``, ``"N-M"`` or "" (all) names.

    Parameters
    ----------
    index : str
    count : int
        Of the list.
    option, things : str
        Of the command line, and in the list, for messages.

    Raises
    ------
    InputError
        If it is not one of these, or outside of the list.
    """
    if not index:
        return range(count)
    first, dash, last = index.partition("-")
    words = (first, last) if dash else (first, first)
    if not all(word.isascii() and word.isdecimal() and len(word) < 10 for word in words):
        raise InputError(f"{option} {index}: expected N or N-M, from 0 on", "SETTING_WRONG")
    start, end = map(int, words)
    if not start <= end < count:
        raise InputError(
            f"{option} {index}: expected N or N-M from 0 to {count - 1}, as the number of {things} "
            f"is {count}",
            "SETTING_WRONG",
        )
    return range(start, end + 1)
