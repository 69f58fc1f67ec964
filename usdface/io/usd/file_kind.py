"""The kind of a USD file among those that usdface writes: by its marks, else by its layout."""

from pathlib import Path

from pxr import Sdf

from usdface.errors import InputError
from usdface.io.usd.fingerprint import is_signed, is_unedited
from usdface.io.usd.generation import layer_generation
from usdface.io.usd.stage import is_usd, open_layer
from usdface.schemas import tokens

__all__ = ["kind_of_usd"]

_RIG = {"/Asset": "Xform", "/Asset/Face": "SkelRoot", "/Asset/Face/Skel": "Skeleton"}
_DELIVERED = {"blendShapes", "blendShapeWeights", "joints", "translations", "rotations", "scales"}
_METRICS = ("metersPerUnit", "upAxis", "timeCodesPerSecond", "framesPerSecond")
_LAYERS = ("closure.usdc", "express.usdc", "solve.usdc")


def kind_of_usd(path: Path, within: Path | None = None) -> tuple[str, str]:
    """Return the kind of output that usdface wrote, and whether it was edited since, if that shows.

    The file counts as it is on the disk; changes of a layer that is open here are edits, too.
    `within` is a file that is composed of it, if one is known.

    Returns
    -------
    str
        "shot", "result", "layer" (of a result), "deliverable", "take", "rig" or "fuzzy system"; ""
        for a file of another origin, or one that cannot be read.
    str
        "edited"; "unsigned" where an older version wrote no fingerprint and there is something
        that may be an edit; "" otherwise, also where nothing tells: of a take, a rig and a fuzzy
        system, which have no fingerprint.
    """
    try:
        layer = open_layer(path, reread=True, within=within) if is_usd(path) else None
    except InputError:
        layer = None
    if layer is None:
        return "", ""
    held = Sdf.Layer.Find(str(path.resolve()))
    kind = _kind(layer)
    return kind, _changed(layer, kind) or (_changed(held, kind) if held and held.dirty else "")


def _kind(layer: Sdf.Layer) -> str:
    place = layer.GetDefaultPrimAsPath()
    prim = layer.GetPrimAtPath(place) if place else None
    shown = prim.typeName if prim else ""
    if layer_generation(layer) or _is_root(layer):
        return "result" if layer.subLayerPaths else "layer"
    if is_signed(layer):
        return "deliverable" if shown == "SkelAnimation" else "shot"
    if shown == tokens.MARKER_TAKE or (
        shown == "SkelAnimation" and layer.GetAttributeAtPath(place.AppendProperty(tokens.SOURCE))
    ):
        return "take"
    if shown == tokens.FUZZY_SYSTEM:
        return "fuzzy system"
    if _is_deliverable(layer):
        return "deliverable"
    return "rig" if all(_type(layer, at) == name for at, name in _RIG.items()) else ""


def _changed(layer: Sdf.Layer, kind: str) -> str:
    if is_signed(layer):
        return "" if is_unedited(layer) else "edited"
    if kind == "result":
        others = [name for name in layer.subLayerPaths if not _is_layer_of_result(name)]
        shot_last = others == layer.subLayerPaths[-1:]
        return "" if shot_last and not layer.rootPrims else "unsigned"
    return "unsigned" if kind == "deliverable" else ""


def _is_deliverable(layer: Sdf.Layer) -> bool:
    """Return whether a layer is one animation alone: once deliverables had no fingerprint."""
    prims = list(layer.rootPrims.values())
    if len(prims) != 1 or prims[0].typeName != "SkelAnimation" or prims[0].nameChildren:
        return False
    names = set(prims[0].properties.keys())
    alone = {"blendShapes", "blendShapeWeights"} <= names <= _DELIVERED and not layer.subLayerPaths
    return alone and all(layer.pseudoRoot.HasInfo(name) for name in _METRICS)


def _is_root(layer: Sdf.Layer) -> bool:
    """Return whether a layer only brings in those of a result: once they had no generation."""
    first = layer.subLayerPaths[0] if layer.subLayerPaths else ""
    return _is_layer_of_result(first) and not layer.rootPrims


def _is_layer_of_result(name: str) -> bool:
    return Path(name).name in _LAYERS and Path(name).parent.suffix == ".usdface"


def _type(layer: Sdf.Layer, place: str) -> str:
    prim = layer.GetPrimAtPath(place)
    return str(prim.typeName) if prim else ""
