"""Attributes and their time samples, authored on layers that no stage need compose."""

from collections.abc import Iterable

import numpy as np
from pxr import Sdf, Vt

from usdface.arrays import FloatArray
from usdface.numerics.frame_blocks import frame_blocks

__all__ = ["write_arrays", "write_samples", "write_value"]


def _attribute(
    prim: Sdf.PrimSpec,
    name: str,
    kind: Sdf.ValueTypeName,
    variability: Sdf.Variability = Sdf.VariabilityVarying,
) -> Sdf.AttributeSpec:
    """Return the attribute of a prim, which is made where there is none."""
    return prim.attributes.get(name) or Sdf.AttributeSpec(prim, name, kind, variability)


def write_value(prim: Sdf.PrimSpec, name: str, kind: Sdf.ValueTypeName, value: object) -> None:
    """Author a uniform attribute."""
    _attribute(prim, name, kind, Sdf.VariabilityUniform).default = value


def write_samples(
    prim: Sdf.PrimSpec,
    name: str,
    kind: Sdf.ValueTypeName,
    codes: Iterable[float],
    values: Iterable[object],
) -> None:
    """Author an attribute with a value for each time code."""
    path = _attribute(prim, name, kind).path
    for code, value in zip(codes, values, strict=True):
        prim.layer.SetTimeSample(path, code, value)


def write_arrays(
    prim: Sdf.PrimSpec, name: str, kind: Sdf.ValueTypeName, codes: FloatArray, rows: FloatArray
) -> None:
    """Author an array of floats (F, N), or of vectors (F, N, 3), for each time code (F,)."""
    array = Vt.Vec3fArray if rows.ndim == 3 else Vt.FloatArray
    for frames in frame_blocks(len(codes)):
        values = map(array.FromNumpy, rows[frames].astype(np.float32))
        write_samples(prim, name, kind, codes[frames].tolist(), values)
