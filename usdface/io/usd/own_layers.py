"""What a USD file is of all that usdface writes: by its marks, else by its layout."""

from pathlib import Path

from pxr import Sdf

from usdface.errors import InputError
from usdface.io.usd.fingerprint import is_signed, is_unedited
from usdface.io.usd.generation import layer_generation
from usdface.io.usd.stage import is_usd, open_layer
from usdface.schemas import tokens

__all__ = ["kind_of_usd"]

_RIG = {"/Asset": "Xform", "/Asset/Face": "SkelRoot", "/Asset/Face/Skel": "Skeleton"}
_LAYERS = ("closure.usdc", "express.usdc", "solve.usdc")


def kind_of_usd(path: Path) -> tuple[str, bool]:
    """Return what usdface wrote a file as, and whether it was edited since, where that shows.

    Returns
    -------
    str
        "shot", "result", "deliverable", "take", "rig" or "fuzzy system"; "" for a file of another
        origin, or one that cannot be read.
    bool
        False where nothing tells: of a take, a rig and a fuzzy system, which have no fingerprint.
    """
    try:
        layer = open_layer(path) if is_usd(path) else None
    except InputError:
        layer = None
    if layer is None:
        return "", False
    return _kind(layer), is_signed(layer) and not is_unedited(layer)


def _kind(layer: Sdf.Layer) -> str:
    place = layer.GetDefaultPrimAsPath()
    prim = layer.GetPrimAtPath(place) if place else None
    shown = prim.typeName if prim else ""
    if layer_generation(layer) or _is_root(layer):
        return "result"
    if is_signed(layer):
        return "deliverable" if shown == "SkelAnimation" else "shot"
    if shown == tokens.MARKER_TAKE or (
        shown == "SkelAnimation" and layer.GetAttributeAtPath(place.AppendProperty(tokens.SOURCE))
    ):
        return "take"
    if shown == tokens.FUZZY_SYSTEM:
        return "fuzzy system"
    return "rig" if all(_type(layer, at) == name for at, name in _RIG.items()) else ""


def _is_root(layer: Sdf.Layer) -> bool:
    """Return whether a layer only brings in those of a result: once they had no generation."""
    first = Path(layer.subLayerPaths[0]) if layer.subLayerPaths else Path()
    ours = first.name in _LAYERS and first.parent.suffix == ".usdface"
    return ours and not layer.rootPrims


def _type(layer: Sdf.Layer, place: str) -> str:
    prim = layer.GetPrimAtPath(place)
    return str(prim.typeName) if prim else ""
