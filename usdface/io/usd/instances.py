"""Prims that instances share, under the paths that a stage shows."""

from pxr import Sdf, Usd

__all__ = ["shown_path"]


def shown_path(prim: Usd.Prim, beside: Usd.Prim) -> Sdf.Path:
    """Return the path of `prim` in the instance that the prim `beside` is in.

    UsdSkel answers with prims of a prototype, whose path no layer has. The path of any other prim
    is its own.
    """
    path, above = prim.GetPath(), beside
    while prim.IsInPrototype() and above and not above.IsPseudoRoot():
        if above.IsInstance() and path.HasPrefix(above.GetPrototype().GetPath()):
            return path.ReplacePrefix(above.GetPrototype().GetPath(), above.GetPath())
        above = above.GetParent()
    return path
