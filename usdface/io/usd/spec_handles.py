"""Handles of the specs of layers that are written, held until these layers are gone.

Of each spec whose last handle goes before its layer does, OpenUSD keeps 32 bytes for ever (26.11,
also from C++: a stage with 40 attributes, made and dropped again and again, grows by 1.3 kB each
time). Of one whose handle outlives the layer it keeps nothing.
"""

from pxr import Sdf

__all__ = ["hold_specs"]

_held: list[list[Sdf.Spec]] = []  # by layer, of those that live, or have gone since the last call


def hold_specs(layer: Sdf.Layer) -> None:
    """Hold the specs of a layer until it is gone, and let go of those of layers that are."""
    handles: list[Sdf.Spec] = []

    def take(path: Sdf.Path) -> None:
        spec = layer.GetObjectAtPath(path)
        if spec:
            handles.append(spec)

    layer.Traverse(Sdf.Path.absoluteRootPath, take)
    _held[:] = [specs for specs in _held if not specs[0].expired] + [handles]
