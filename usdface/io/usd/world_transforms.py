"""Transforms of prims to the world."""

import numpy as np
from pxr import Usd, UsdGeom

from usdface.arrays import FloatArray
from usdface.io.usd.prim_walks import lineage

__all__ = ["moves_in_world", "transform_codes", "world_transform"]


def world_transform(prim: Usd.Prim, code: float) -> FloatArray:
    """Return the transform (4, 4) of a prim to the world, for row vectors."""
    return np.array(UsdGeom.XformCache(code).GetLocalToWorldTransform(prim), np.float64)


def moves_in_world(prim: Usd.Prim) -> bool:
    """Return whether the transform of a prim, or of one above it, may vary over time."""
    xforms = (UsdGeom.Xformable(each) for each in lineage(prim))
    return any(xform and xform.TransformMightBeTimeVarying() for xform in xforms)


def transform_codes(xform: UsdGeom.Xformable) -> list[float]:
    """Return the time codes of the samples, and of the knots of splines, of a prim's transform."""
    codes = {*xform.GetTimeSamples()}
    for attribute in (op.GetAttr() for op in xform.GetOrderedXformOps()):
        if not attribute.GetTimeSamples() and attribute.HasSpline():  # samples count before splines
            codes |= {*attribute.GetSpline().GetKnots().keys()}
    return sorted(codes)
