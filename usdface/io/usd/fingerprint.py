"""The fingerprint of a layer that usdface wrote: whether it was edited since.

It is ``customLayerData["usdface"]["fingerprint"]``, a digest of all else in the layer.
"""

import hashlib
from collections.abc import Mapping

from pxr import Sdf

from usdface.io.usd.conversion_metadata import KEY
from usdface.io.usd.held_layers import hold_specs

__all__ = ["is_signed", "is_unedited", "sign"]

_FINGERPRINT = "fingerprint"


def sign(layer: Sdf.Layer) -> None:
    """Author the fingerprint of a layer that is about to be written."""
    data = dict(layer.customLayerData)
    layer.customLayerData = {**data, KEY: {**data.get(KEY, {}), _FINGERPRINT: _digest(layer)}}


def is_signed(layer: Sdf.Layer) -> bool:
    """Return whether a layer has a fingerprint, be it that of its content or not."""
    return _found(layer) is not None


def is_unedited(layer: Sdf.Layer) -> bool:
    """Return whether a layer has a fingerprint, and that of its content."""
    found = _found(layer)
    return found is not None and found == _digest(layer)


def _found(layer: Sdf.Layer) -> object:
    mine = layer.customLayerData.get(KEY)
    return mine.get(_FINGERPRINT) if isinstance(mine, Mapping) else None


def _digest(layer: Sdf.Layer) -> str:
    copy = Sdf.Layer.CreateAnonymous(".usda")
    copy.TransferContent(layer)
    data = dict(copy.customLayerData)
    mine = {name: value for name, value in data.pop(KEY, {}).items() if name != _FINGERPRINT}
    copy.customLayerData = {**data, **({KEY: mine} if mine else {})}
    text = copy.ExportToString()
    hold_specs(copy)
    return hashlib.sha256(text.encode()).hexdigest()
