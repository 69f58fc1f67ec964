"""The fingerprint of a layer that usdface wrote: whether it was edited since.

It is ``customLayerData["usdface"]["fingerprint"]``, a digest of all else in the layer.
"""

import hashlib
from collections.abc import Iterator
from typing import Any

import numpy as np
from pxr import Sdf

from usdface.io.usd.conversion_metadata import KEY, read_layer_metadata, write_layer_metadata
from usdface.io.usd.held_layers import hold_specs

__all__ = ["is_signed", "is_unedited", "sign"]

_FINGERPRINT = "fingerprint"
_BY_SAMPLES = "samples:"  # begins a fingerprint that `sign` made of a take
_SAMPLES = "timeSamples"


def sign(layer: Sdf.Layer, *, take: bool = False) -> None:
    """Author the fingerprint of a layer that is about to be written.

    Of a `take` the samples are digested one after the other: as text they take as much memory as
    the layer, and four times as long.
    """
    made = _BY_SAMPLES + _digest_of_take(layer) if take else _digest(layer)
    write_layer_metadata(layer, _FINGERPRINT, made)


def is_signed(layer: Sdf.Layer) -> bool:
    """Return whether a layer has a fingerprint, be it that of its content or not."""
    return _found(layer) is not None


def is_unedited(layer: Sdf.Layer) -> bool:
    """Return whether a layer has a fingerprint, and that of its content."""
    found = _found(layer)
    if isinstance(found, str) and found.startswith(_BY_SAMPLES):
        return found == _BY_SAMPLES + _digest_of_take(layer)
    return found is not None and found == _digest(layer)


def _found(layer: Sdf.Layer) -> object:
    return read_layer_metadata(layer).get(_FINGERPRINT)


def _digest(layer: Sdf.Layer) -> str:
    copy = Sdf.Layer.CreateAnonymous(".usda")
    copy.TransferContent(layer)
    return hashlib.sha256(_text(copy)).hexdigest()


def _digest_of_take(layer: Sdf.Layer) -> str:
    copy, root = Sdf.Layer.CreateAnonymous(".usda"), Sdf.Path.absoluteRootPath
    Sdf.CopySpec(layer, root, copy, root, _is_no_sample, lambda *_: True)
    digest = hashlib.sha256(_text(copy))
    paths: list[Sdf.Path] = []
    layer.Traverse(root, paths.append)
    for path in sorted(paths):
        codes = layer.ListTimeSamplesForPath(path)
        if not codes:
            continue
        digest.update(f"{path}\n".encode())
        digest.update(np.array(codes, np.float64).tobytes())
        samples = [layer.QueryTimeSample(path, code) for code in codes]
        for part in _parts(samples):
            digest.update(part)
    return digest.hexdigest()


def _is_no_sample(_: object, field: str, *__: object) -> bool:
    return field != _SAMPLES


def _parts(samples: list[Any]) -> Iterator[Any]:
    """Yield the parts that distinguish samples: lengths and numbers of arrays, as in memory."""
    try:
        views = [memoryview(sample) for sample in samples]
    except TypeError:  # numbers, text or blocks, whose own text has an address
        yield repr([None if isinstance(s, Sdf.ValueBlock) else s for s in samples]).encode()
        return
    yield np.array([view.nbytes for view in views])
    yield from views


def _text(copy: Sdf.Layer) -> bytes:
    """Return a layer as text, apart from its fingerprint, which it loses."""
    data = dict(copy.customLayerData)
    mine = {name: value for name, value in data.pop(KEY, {}).items() if name != _FINGERPRINT}
    copy.customLayerData = {**data, **({KEY: mine} if mine else {})}
    text: str = copy.ExportToString()
    hold_specs(copy)
    return text.encode()
