"""Units and axes of layers that differ from those of their stage.

USD converts neither: a head in centimetres under a stage in metres is a hundred times as large,
unless a prim between them scales it.
"""

from collections.abc import Iterable

import numpy as np
from pxr import Sdf, Usd, UsdGeom

from usdface.findings import Finding, finding
from usdface.io.usd.held_layers import hold
from usdface.io.usd.metrics import metrics_of

__all__ = ["report_mixed_metrics"]

_SAME = 1e-6  # of a matrix: USD's doubles, and metres per unit that were computed
_UNIT, _AXIS = UsdGeom.Tokens.metersPerUnit, UsdGeom.Tokens.upAxis


def report_mixed_metrics(stage: Usd.Stage, meshes: Iterable[Usd.Prim]) -> list[Finding]:
    """Return METRICS_MIXED for layers of meshes that are not converted.

    A mesh whose transform to the world scales or turns it may be, and is not reported.
    """
    metrics = metrics_of(stage)
    xforms = UsdGeom.XformCache(Usd.TimeCode.EarliestTime())
    found: dict[tuple[str, str], Finding] = {}
    for prim in meshes:
        layer = _defining_layer(prim)
        if layer is None or layer == stage.GetRootLayer():
            continue
        world = np.array(xforms.GetLocalToWorldTransform(prim))
        turned = not np.allclose(world[:3, :3], np.eye(3), atol=_SAME)
        for name, own in ((_UNIT, metrics.meters_per_unit), (_AXIS, metrics.up_axis)):
            value = layer.pseudoRoot.GetInfo(name) if layer.pseudoRoot.HasInfo(name) else own
            same = value == own if name == _AXIS else np.isclose(value, own, rtol=_SAME)
            if same or turned:
                continue
            message = (
                "{layer} has {name} {value}, the stage {other_value}: USD does not convert; "
                "scale or turn its prims, if they are meant to be"
            )
            where = layer.GetDisplayName()
            values = where, name, value, own
            found[where, name] = finding("METRICS_MIXED", str(prim.GetPath()), message, *values)
    return list(found.values())


def _defining_layer(prim: Usd.Prim) -> Sdf.Layer | None:
    """Return the layer that has the points of a mesh."""
    specs = UsdGeom.Mesh(prim).GetPointsAttr().GetPropertyStack(Usd.TimeCode.EarliestTime())
    hold(specs)
    return specs[0].layer if specs else None
