"""Prim names for any text: legal, unique among siblings, and always the same."""

from collections.abc import Iterable

from pxr import Sdf

from usdface.io.unique_name import unique_name

__all__ = ["prim_names"]


def prim_names(originals: Iterable[str], taken: Iterable[str] = ()) -> tuple[str, ...]:
    """Return a legal prim name for each original, unique among themselves and `taken`.

    A character that USD does not allow becomes `_`; UTF-8 identifiers stay as they are
    (`Tf.MakeValidIdentifier` would make every one of their bytes a `_`). Names that are
    legal already come first; of equal ones the later are suffixed `_1`, `_2`, ...

    Source: measured with `Sdf.Path.IsValidIdentifier` of OpenUSD 26.11.
    """
    names = list(originals)
    used = set(taken)
    result = [""] * len(names)
    for place in sorted(range(len(names)), key=lambda p: not Sdf.Path.IsValidIdentifier(names[p])):
        result[place] = unique_name(_legal(names[place]), used)
        used.add(result[place])
    return tuple(result)


def _legal(name: str) -> str:
    if Sdf.Path.IsValidIdentifier(name):
        return name
    changed = "".join(c if Sdf.Path.IsValidIdentifier(f"_{c}") else "_" for c in name)
    return changed if Sdf.Path.IsValidIdentifier(changed) else f"_{changed}"
