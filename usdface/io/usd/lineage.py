"""A prim and its ancestors."""

from collections.abc import Iterator

from pxr import Usd

__all__ = ["lineage"]


def lineage(prim: Usd.Prim) -> Iterator[Usd.Prim]:
    """Yield a prim and its ancestors, from the nearest on; not the pseudo-root."""
    while prim and not prim.IsPseudoRoot():
        yield prim
        prim = prim.GetParent()
