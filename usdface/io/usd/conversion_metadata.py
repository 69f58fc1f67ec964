"""What only a conversion needs to know, apart from what users author: customData["usdface"]."""

from collections.abc import Mapping
from typing import Any

from pxr import Usd, UsdShade

__all__ = ["KEY", "note", "our_notes"]

KEY = "usdface"


def our_notes(of: Usd.Prim | UsdShade.ConnectableAPI | Any) -> Mapping[str, Any]:
    """Return our notes on a prim, or on the prim of a schema; empty where there are none."""
    prim = of if isinstance(of, Usd.Prim) else of.GetPrim()
    notes = prim.GetCustomDataByKey(KEY)
    return notes if isinstance(notes, Mapping) else {}


def note(prim: Usd.Prim, name: str, value: object) -> None:
    """Put one note on a prim."""
    prim.SetCustomDataByKey(f"{KEY}:{name}", value)
