"""Units and axes of layers that differ from those of their stage.

USD converts neither: a head in centimetres under a stage in metres is a hundred times as large,
unless a prim between them scales it.
"""

from collections.abc import Iterable, Iterator

import numpy as np
from pxr import Sdf, Usd, UsdGeom

from usdface.findings import Finding, finding
from usdface.io.usd.held_layers import hold
from usdface.io.usd.metrics import Metrics, metrics_of

__all__ = ["report_mixed_metrics", "report_mixed_sublayer"]

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
        if turned:
            continue
        message = (
            "{layer} has {name} {value}, the stage {other_value}: USD does not convert; "
            "scale or turn its prims, if they are meant to be"
        )
        where = layer.GetDisplayName()
        for name, value, own in _other_metrics(layer, metrics):
            values = where, name, value, own
            found[where, name] = finding("METRICS_MIXED", str(prim.GetPath()), message, *values)
    return list(found.values())


def report_mixed_sublayer(stage: Usd.Stage, prim: Usd.Prim) -> list[Finding]:
    """Return METRICS_MIXED where a layer over the one that defines a prim has other metrics.

    No prim between sublayers can scale or turn the contents of the lower one.
    """
    root = stage.GetRootLayer()
    local = stage.GetLayerStack(includeSessionLayers=False)
    specs = prim.GetPrimStack()
    hold(specs)
    defined = [spec.layer for spec in specs if spec.specifier == Sdf.SpecifierDef]
    if not defined or defined[-1] == root or defined[-1] not in local:
        return []
    message = (
        "{layer} has {name} {value}, the stage {other_value}: USD does not convert sublayers; "
        "give the stage that of the sublayer"
    )
    where, path = defined[-1].GetDisplayName(), str(prim.GetPath())
    return [
        finding("METRICS_MIXED", path, message, where, name, value, own)
        for name, value, own in _other_metrics(defined[-1], metrics_of(stage))
        if root.pseudoRoot.HasInfo(name)  # else it is said that the stage lacks it
    ]


def _other_metrics(layer: Sdf.Layer, of_stage: Metrics) -> Iterator[tuple[str, object, object]]:
    """Yield unit and axis that a layer has otherwise than its stage: name, its value, the other."""
    for name, own in ((_UNIT, of_stage.meters_per_unit), (_AXIS, of_stage.up_axis)):
        value = layer.pseudoRoot.GetInfo(name) if layer.pseudoRoot.HasInfo(name) else own
        if not (value == own if name == _AXIS else np.isclose(value, own, rtol=_SAME)):
            yield name, value, own


def _defining_layer(prim: Usd.Prim) -> Sdf.Layer | None:
    """Return the layer that has the points of a mesh."""
    specs = UsdGeom.Mesh(prim).GetPointsAttr().GetPropertyStack(Usd.TimeCode.EarliestTime())
    hold(specs)
    return specs[0].layer if specs else None
