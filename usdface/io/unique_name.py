"""Names that are not taken yet."""

from collections.abc import Container

__all__ = ["unique_name"]


def unique_name(name: str, taken: Container[str]) -> str:
    """Return a name, or with the first number behind it that makes it none of those `taken`.

    >>> unique_name("st", ()), unique_name("st", ("st", "st_1"))
    ('st', 'st_2')
    """
    candidate, number = name, 0
    while candidate in taken:
        number += 1
        candidate = f"{name}_{number}"
    return candidate
