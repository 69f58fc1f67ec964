"""Metadata of usdface on prims and layers, apart from that of users: under the key "usdface"."""

from collections.abc import Mapping
from typing import Any

from pxr import Sdf, Usd, UsdShade

__all__ = [
    "CONTENT_NAME",
    "KEY",
    "SKIN_NAME",
    "read_layer_metadata",
    "read_metadata",
    "write_layer_metadata",
    "write_metadata",
]

KEY = "usdface"
CONTENT_NAME = "contentName"  # of a glTF mesh, camera or light whose node has another
SKIN_NAME = "skinName"  # of a skeleton: that of its glTF skin


def read_metadata(of: Usd.Prim | UsdShade.ConnectableAPI | Any) -> Mapping[str, Any]:
    """Return the metadata of a prim, or of the prim of a schema; empty where there is none."""
    prim = of if isinstance(of, Usd.Prim) else of.GetPrim()
    notes = prim.GetCustomDataByKey(KEY)
    return notes if isinstance(notes, Mapping) else {}


def write_metadata(prim: Usd.Prim, name: str, value: object) -> None:
    """Author one entry on a prim."""
    prim.SetCustomDataByKey(f"{KEY}:{name}", value)


def read_layer_metadata(layer: Sdf.Layer) -> Mapping[str, Any]:
    """Return the metadata of a layer; empty where there is none."""
    notes = layer.customLayerData.get(KEY)
    return notes if isinstance(notes, Mapping) else {}


def write_layer_metadata(layer: Sdf.Layer, name: str, value: object) -> None:
    """Author one entry on a layer."""
    notes = {**read_layer_metadata(layer), name: value}
    layer.customLayerData = {**layer.customLayerData, KEY: notes}
