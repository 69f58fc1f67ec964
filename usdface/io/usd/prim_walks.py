"""Walks over prims: up from one to the root, and down past prims of some types."""

from collections.abc import Iterator

from pxr import Usd

__all__ = ["lineage", "prims_without"]

_ALL = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)


def lineage(prim: Usd.Prim) -> Iterator[Usd.Prim]:
    """Yield a prim and its ancestors, from the nearest on; not the pseudo-root."""
    while prim and not prim.IsPseudoRoot():
        yield prim
        prim = prim.GetParent()


def prims_without(top: Usd.Prim, *types: type) -> Iterator[Usd.Prim]:
    """Yield the prims at and below one, but for those at and below a prim of some types."""
    prims = iter(Usd.PrimRange(top, _ALL))
    for prim in prims:
        if any(map(prim.IsA, types)):
            prims.PruneChildren()
        else:
            yield prim
