"""Prepared overs that are put on the edit target of a stage: all or nothing."""

from collections.abc import Callable, Iterator
from contextlib import suppress

from pxr import Sdf, Tf, Usd

from usdface.errors import OutputError
from usdface.findings import Finding, finding
from usdface.io.usd.animation_source import add_applied_schema
from usdface.io.usd.errors import usd_message

__all__ = ["prims_of", "put_overs"]


def put_overs(
    overs: Sdf.Layer, stage: Usd.Stage, stale: Callable[[str], bool] = lambda name: False
) -> list[Finding]:
    """Put the prims of a layer on the edit target of a stage, inside its variant if it has one.

    Properties are replaced whole, so that no samples of an earlier result are left. The stage
    changes once; if anything fails, it is as before.

    Parameters
    ----------
    overs : Sdf.Layer
        Its paths are the stage's, its time codes those of the edit target.
    stage : Usd.Stage
    stale : callable
        Of the name of a property on one of the prims: whether to remove it where `overs` lacks it.

    Returns
    -------
    list of Finding
        ATTRIBUTE_REPLACED for attributes of another type.

    Raises
    ------
    OutputError
        If USD refuses it.
    """
    target = stage.GetEditTarget()
    layer = target.GetLayer()
    kept = Sdf.Layer.CreateAnonymous(".usda")
    places = {prim.path: target.MapToSpecPath(prim.path) for prim in prims_of(overs)}
    new = _missing(layer, places.values())
    findings = []
    try:
        with Sdf.ChangeBlock():
            try:
                for prim in prims_of(overs):
                    place = places[prim.path]
                    spec = layer.GetPrimAtPath(place)
                    if spec:
                        _keep(spec, kept, prim.path)
                    spec = spec or Sdf.CreatePrimInLayer(layer, place)
                    findings += _put(prim, spec, stale)
            # Also after Ctrl-C or a host's cancel: half a result is never left on the stage.
            except BaseException:
                _restore(places, kept, layer, new)
                raise
    except Tf.ErrorException as error:
        raise OutputError(
            f"the result cannot be authored on {layer.identifier}: {usd_message(error)}; it is as "
            "before"
        ) from error
    return findings


def _put(prim: Sdf.PrimSpec, spec: Sdf.PrimSpec, stale: Callable[[str], bool]) -> list[Finding]:
    findings = []
    if prim.specifier != Sdf.SpecifierOver:
        spec.specifier, spec.typeName = prim.specifier, prim.typeName
    for schema in _schemas(prim):
        add_applied_schema(spec, schema)
    for old in list(spec.properties):
        if stale(old.name) and old.name not in prim.properties:
            spec.RemoveProperty(old)
    for made in prim.properties:
        before = spec.properties.get(made.name)
        if before is not None and _kind(before) != _kind(made):
            message = "it is {found}, the result is {written}; replaced"
            findings.append(
                finding("ATTRIBUTE_REPLACED", str(made.path), message, _kind(before), _kind(made))
            )
        if before is not None:
            spec.RemoveProperty(before)
        place = spec.path.AppendProperty(made.name)
        if not Sdf.CopySpec(prim.layer, made.path, spec.layer, place):
            raise OutputError(f"<{place}> cannot be authored on {spec.layer.identifier}")
    return findings


def _schemas(spec: Sdf.PrimSpec) -> list[str]:
    return list(spec.GetInfo("apiSchemas").prependedItems) if spec.HasInfo("apiSchemas") else []


def _kind(spec: Sdf.PropertySpec) -> str:
    return str(spec.typeName) if isinstance(spec, Sdf.AttributeSpec) else "relationship"


def prims_of(layer: Sdf.Layer) -> Iterator[Sdf.PrimSpec]:
    """Yield the prims of a layer, parents before their children."""
    waiting = list(layer.rootPrims)
    while waiting:
        prim = waiting.pop(0)
        yield prim
        waiting += list(prim.nameChildren)


def _missing(layer: Sdf.Layer, places: object) -> list[Sdf.Path]:
    """Return the highest prims that are to be made, to be removed again where that fails."""
    new: dict[Sdf.Path, None] = {}
    for place in places:  # type: ignore[attr-defined]
        for path in place.GetPrefixes():
            if path.IsPrimPath() and not layer.GetPrimAtPath(path):
                new[path] = None
                break
    return list(new)


def _keep(spec: Sdf.PrimSpec, kept: Sdf.Layer, path: Sdf.Path) -> None:
    copy = Sdf.CreatePrimInLayer(kept, path)
    _copy_kind(copy, spec)
    for old in spec.properties:
        Sdf.CopySpec(spec.layer, old.path, kept, path.AppendProperty(old.name))


def _copy_kind(spec: Sdf.PrimSpec, other: Sdf.PrimSpec) -> None:
    """Give a prim the specifier, type and applied schemas of another; a type it need not have."""
    spec.specifier = other.specifier
    if other.typeName:
        spec.typeName = other.typeName
    else:
        spec.ClearInfo("typeName")
    if other.HasInfo("apiSchemas"):
        spec.SetInfo("apiSchemas", other.GetInfo("apiSchemas"))
    else:
        spec.ClearInfo("apiSchemas")


def _restore(
    places: dict[Sdf.Path, Sdf.Path], kept: Sdf.Layer, layer: Sdf.Layer, new: list[Sdf.Path]
) -> None:
    for path, place in places.items():
        spec, old = layer.GetPrimAtPath(place), kept.GetPrimAtPath(path)
        if not spec or not old or any(place.HasPrefix(made) for made in new):
            continue
        _copy_kind(spec, old)
        for made in list(spec.properties):
            spec.RemoveProperty(made)
        for before in old.properties:
            Sdf.CopySpec(kept, before.path, layer, place.AppendProperty(before.name))
    for place in new:
        spec = layer.GetPrimAtPath(place)
        if spec:
            with suppress(KeyError, AttributeError):
                del spec.nameParent.nameChildren[spec.name]
