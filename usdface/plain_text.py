"""Text from outside in messages: one line, printable, of bounded length."""

__all__ = ["plain"]


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
