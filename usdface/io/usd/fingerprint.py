"""The fingerprint of a layer that usdface wrote: whether it was edited since.

It is ``customLayerData["usdface"]["fingerprint"]``, a digest of all else in the layer.
"""

import hashlib
from pathlib import Path

from pxr import Sdf

from usdface.errors import InputError, OutputError
from usdface.io.usd.closed_layers import hold_specs
from usdface.io.usd.conversion_metadata import KEY
from usdface.io.usd.stage import is_usd, open_layer

__all__ = ["check_unedited", "is_unedited", "sign"]

_FINGERPRINT = "fingerprint"


def sign(layer: Sdf.Layer) -> None:
    """Author the fingerprint of a layer that is about to be written."""
    data = dict(layer.customLayerData)
    layer.customLayerData = {**data, KEY: {**data.get(KEY, {}), _FINGERPRINT: _digest(layer)}}


def is_unedited(layer: Sdf.Layer) -> bool:
    """Return whether a layer has a fingerprint, and that of its content."""
    mine = layer.customLayerData.get(KEY)
    found = mine.get(_FINGERPRINT) if isinstance(mine, dict) else None
    return found is not None and found == _digest(layer)


def check_unedited(path: Path) -> None:
    """Refuse to replace a file that usdface did not write, or that was edited since.

    Raises
    ------
    OutputError
    """
    if not path.is_file():
        return
    try:
        unedited = is_usd(path) and is_unedited(open_layer(path))
    except InputError:
        unedited = False
    if not unedited:
        raise OutputError(
            f"{path} was edited since usdface wrote it, or is of another origin; --overwrite "
            "replaces it, another name keeps it"
        )


def _digest(layer: Sdf.Layer) -> str:
    copy = Sdf.Layer.CreateAnonymous(".usda")
    copy.TransferContent(layer)
    data = dict(copy.customLayerData)
    mine = {name: value for name, value in data.pop(KEY, {}).items() if name != _FINGERPRINT}
    copy.customLayerData = {**data, **({KEY: mine} if mine else {})}
    text = copy.ExportToString()
    hold_specs(copy)
    return hashlib.sha256(text.encode()).hexdigest()
