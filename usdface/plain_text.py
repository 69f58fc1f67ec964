"""Text in messages: from outside in one printable line, names as a list; of bounded length."""

from collections.abc import Sequence

__all__ = ["error_line", "listed", "plain"]


def plain(text: str, most: int, keep: str = "") -> str:
    r"""Return a text with control characters escaped, and cut in its middle where it is long.

    Parameters
    ----------
    text : str
    most : int
        Length [characters] that is left as it is.
    keep : str
        Characters that are not escaped.

    Examples
    --------
    >>> plain("a\x1b[31m\nb", 80)
    'a\\x1b[31m\\nb'
    """
    if len(text) > most:
        text = f"{text[: 2 * most // 3]} ... {text[-most // 3 :]}"
    if text.isprintable():
        return text
    return "".join(
        c if c.isprintable() or c in keep else c.encode("unicode_escape").decode() for c in text
    )


def error_line(error: BaseException) -> str:
    """Return the type and the message of an error of other code in one line."""
    return " ".join(f"{type(error).__name__}: {error}".split())


def listed(names: Sequence[object], most: int) -> str:
    """Return the first names as a list, and how many more there are; "" of none.

    Examples
    --------
    >>> listed(["chin", "nose", "brow"], 2)
    'chin, nose and 1 more'
    """
    rest = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(map(str, names[:most])) + rest
