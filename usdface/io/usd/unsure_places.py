"""Proposed vertices of a shot that are too unsure to be bound."""

import numpy as np
from pxr import Sdf, Usd, Vt

from usdface.io.usd.attributes import author, strings_of, value_or
from usdface.schemas import tokens
from usdface.setup.binding import Binding

__all__ = ["read_unsure", "write_unsure"]

_NAMES = Sdf.ValueTypeNames


def write_unsure(prim: Usd.Prim, unsure: Binding) -> None:
    """Author them on a `UsdFaceRetarget` prim; empty arrays only over opinions that are there."""
    confidence = () if unsure.confidence is None else unsure.confidence.tolist()
    for name, kind, values in (
        (tokens.BIND_UNSURE_MARKERS, _NAMES.TokenArray, Vt.TokenArray(unsure.markers)),
        (tokens.BIND_UNSURE_POINTS, _NAMES.IntArray, Vt.IntArray(unsure.points.tolist())),
        (tokens.BIND_UNSURE_CONFIDENCE, _NAMES.FloatArray, Vt.FloatArray(confidence)),
    ):
        if values or prim.GetAttribute(name).HasAuthoredValue():
            author(prim, name, kind, values)


def read_unsure(prim: Usd.Prim, binding: Binding) -> Binding:
    """Read them; a marker that a stronger layer binds is not among them any more.

    Raises
    ------
    InputError
        If there are not as many of each.
    """
    sure = np.array(value_or(prim, tokens.BIND_UNSURE_CONFIDENCE, ()), dtype=np.float64)
    points = np.array(value_or(prim, tokens.BIND_UNSURE_POINTS, ()), dtype=np.int64)
    markers = strings_of(prim, tokens.BIND_UNSURE_MARKERS)
    read = Binding(markers, points, binding.mesh, sure if sure.size else None)
    bound = set(binding.markers)
    left = [i for i, name in enumerate(read.markers) if name not in bound]
    return Binding(
        tuple(read.markers[i] for i in left),
        read.points[left],
        read.mesh,
        None if read.confidence is None else read.confidence[left],
    )
