"""Handles of layers are held until the layer is closed, so that USD frees its memory.

OpenUSD (26.11, also from C++) keeps 32 bytes for ever of each spec whose last handle goes before
its layer does, and in Python two objects and 250 bytes of each layer that is first reached
through its stage. Nothing is kept of a spec that has a handle when its layer goes, and of a layer
that Python has owned. `tests/attack/soak.py --usd` measures both without usdface.
"""

from collections.abc import Iterable

from pxr import Sdf, Usd

__all__ = ["hold", "hold_layers", "hold_specs"]

# Handles by layer and path; of layers that are closed until the next call.
_held: dict[str, dict[Sdf.Path, Sdf.Spec]] = {}


def hold(specs: Iterable[Sdf.Spec]) -> None:
    """Hold handles of specs until their layers are closed."""
    for name in list(_held):
        if _held[name][Sdf.Path.absoluteRootPath].expired:
            _held.pop(name, None)
    for spec in specs:
        layer = spec.layer
        if layer.identifier not in _held:
            _held[layer.identifier] = {Sdf.Path.absoluteRootPath: layer.pseudoRoot}
        _held[layer.identifier][spec.path] = spec


def hold_specs(layer: Sdf.Layer) -> None:
    """Hold a handle of each spec of a layer until it is closed.

    For layers that are written, or looked through by USD's own functions, which makes handles of
    all specs for a moment.
    """
    paths: list[Sdf.Path] = []
    layer.Traverse(Sdf.Path.absoluteRootPath, paths.append)
    # Python gets no handle of the spec of a target, but USD makes one to look.
    found = (layer.GetObjectAtPath(path) for path in paths if not path.IsTargetPath())
    hold(spec for spec in found if spec)


def hold_layers(stage: Usd.Stage) -> None:
    """Own each layer of a stage for a moment, and hold a handle of its root until it is closed."""
    for layer in stage.GetUsedLayers():
        name = layer.identifier
        # By its name it may be another one under the resolver context that is bound now.
        if Sdf.Layer.Find(name) == layer:
            hold([Sdf.Layer.FindOrOpen(name).pseudoRoot])
