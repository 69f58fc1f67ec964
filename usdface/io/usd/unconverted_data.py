"""Data of a stage that a rig has no place for: attributes, metadata, variants, skeletons."""

from collections.abc import Collection, Iterator

from pxr import Sdf, Usd, UsdGeom, UsdLux, UsdShade, UsdSkel

from usdface.findings import Finding, finding
from usdface.io.usd.attributes import changes
from usdface.io.usd.extras import USER_PROPERTIES, read_extras
from usdface.io.usd.prim_walks import prims_without
from usdface.io.usd.stage import stage_name
from usdface.io.usd.variant_stages import stage_with_variant

__all__ = [
    "report_empty_groups",
    "report_unbound_skeletons",
    "report_unconverted_data",
    "report_unconverted_variants",
]

_ALL = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)
# Prims and attributes of a take and its result, which are no part of the picture.
_OUR_TYPES, _OURS = "UsdFace", "usdface:"
# Of USD's own schemas; a prim that does not apply one has its properties as custom ones.
_OF_SCHEMAS = ("material:", "primvars:", "skel:")
# What Blender, Maya and Houdini note on each prim that they write: their own names of it, and that
# they made it. Nobody misses it, and it would hide what somebody does.
_NOTES_OF_EXPORTERS = ("userProperties:blender:", "userProperties:blenderName:", "Houdini")
_MADE = {"generated": True}  # customData of Blender and Maya, below a key of their name
_MATERIALS = "material"  # the set that becomes material variants of glTF


def report_unconverted_data(stage: Usd.Stage, kept: Collection[str]) -> list[Finding]:
    """Return CHANNEL_IGNORED for custom attributes and customData that nothing keeps.

    Parameters
    ----------
    stage : Usd.Stage
    kept : collection of str
        Paths of prims whose extras are read, beside cameras, lights and materials.
    """
    lost = [name for prim in stage.Traverse(_ALL) for name in _unread(prim, kept)]
    if not lost:
        return []
    where = stage_name(stage)
    message = "custom attributes and metadata that usdface does not keep: {channels}"
    return [finding("CHANNEL_IGNORED", where, message, lost)]


def _unread(prim: Usd.Prim, kept: Collection[str]) -> Iterator[str]:
    """Yield the custom attributes and metadata of a prim that are left out."""
    if str(prim.GetTypeName()).startswith(_OUR_TYPES):
        return
    path, read = str(prim.GetPath()), _has_extras(prim, kept)
    if not read:
        yield from (f"{path} {name}" for name in _metadata(prim))
    for each in prim.GetAuthoredProperties():
        name = each.GetName()
        if not each.IsCustom() or name.startswith((_OURS, *_OF_SCHEMAS, *_NOTES_OF_EXPORTERS)):
            continue
        varies = isinstance(each, Usd.Attribute) and changes(each)
        if varies or not (read and name.startswith(USER_PROPERTIES)):
            yield f"{path}.{name}"


def _has_extras(prim: Usd.Prim, kept: Collection[str]) -> bool:
    if str(prim.GetPath()) in kept or prim.IsA(UsdShade.Material):
        return True
    return bool(prim.IsA(UsdGeom.Camera) or prim.HasAPI(UsdLux.LightAPI))


def _metadata(prim: Usd.Prim) -> list[str]:
    """Return the keys of a prim's customData that are of no schema, conversion or exporter."""
    if not prim.HasAuthoredCustomData():
        return []
    extras, _ = read_extras(prim, properties=False)
    return sorted(
        key
        for key, value in extras.items()
        if value != _MADE and not key.startswith(_NOTES_OF_EXPORTERS)
    )


def report_unconverted_variants(stage: Usd.Stage, materials: bool = True) -> list[Finding]:
    """Return FEATURE_DROPPED for variants of a stage that are neither clips nor `materials`.

    Of those only the selected one is converted. Where a set chooses between animations its
    variants are clips (`usdface.io.usd.clip_variants`). The stage is not changed.
    """
    lost = [
        f"{prim.GetPath()} {name}={chosen or 'none'}"
        for prim in stage.Traverse(_ALL)
        for name, chosen in _sets(prim)
        if not (materials and name == _MATERIALS and prim == stage.GetDefaultPrim())
        and not _chooses_animation(stage, prim, name, chosen)
    ]
    if not lost:
        return []
    where = stage_name(stage)
    message = "only the selected variant is converted of {variants}"
    return [finding("FEATURE_DROPPED", where, message, lost, feature="variants")]


def _sets(prim: Usd.Prim) -> Iterator[tuple[str, str]]:
    """Yield the variant sets of a prim in which there is something to choose, and the choice."""
    if not prim.HasVariantSets() or prim.IsInstanceProxy():
        return
    for name in prim.GetVariantSets().GetNames():
        one = prim.GetVariantSet(name)
        if set(one.GetVariantNames()) - {one.GetVariantSelection()}:
            yield name, one.GetVariantSelection()


def _chooses_animation(stage: Usd.Stage, prim: Usd.Prim, name: str, chosen: str) -> bool:
    """Return whether another variant of a set has the same prims, but binds other animations."""
    below = Usd.PrimRange(prim, _ALL)
    if not UsdSkel.Root.Find(prim) and not any(each.IsA(UsdSkel.Root) for each in below):
        return False  # of a set: without opening the stage once for each of its variants
    before = _bound_and_other(stage, prim.GetPath())
    for variant in prim.GetVariantSet(name).GetVariantNames():
        if variant == chosen:
            continue
        other = stage_with_variant(stage, prim.GetPath(), name, variant)
        animations, prims = _bound_and_other(other, prim.GetPath())
        if prims == before[1] and animations != before[0]:
            return True
    return False


def _bound_and_other(
    stage: Usd.Stage, path: Sdf.Path
) -> tuple[set[tuple[Sdf.Path, ...]], set[Sdf.Path]]:
    """Return the bound animations below a prim, and the paths of all prims but animations."""
    prims = list(Usd.PrimRange(stage.GetPrimAtPath(path), _ALL))
    bindings = (UsdSkel.BindingAPI(prim).GetAnimationSourceRel() for prim in prims)
    bound = {tuple(rel.GetTargets()) for rel in bindings if rel}
    return bound, {prim.GetPath() for prim in prims if not prim.IsA(UsdSkel.Animation)}


def report_unbound_skeletons(stage: Usd.Stage, bound: Collection[Usd.Prim]) -> list[Finding]:
    """Return FEATURE_DROPPED for skeletons with joints that bind no mesh."""
    read = {skeleton.GetPath() for skeleton in bound}
    found = []
    # Prototypes of instancers are not shown where they stand.
    for prim in prims_without(stage.GetPseudoRoot(), UsdGeom.PointInstancer):
        if prim.IsA(UsdSkel.Skeleton) and prim.GetPath() not in read:
            joints = list(map(str, UsdSkel.Skeleton(prim).GetJointsAttr().Get() or ()))
            message = "the skeleton is left out, as it is bound to no mesh: {names}"
            where = str(prim.GetPath())
            lost = finding("FEATURE_DROPPED", where, message, joints, feature="skeleton")
            found += [lost] if joints else []
    return found


def report_empty_groups(stage: Usd.Stage, kept: Collection[str]) -> list[Finding]:
    """Return NODES_DROPPED for Xforms with nothing below but such, as locators and sockets.

    Parameters
    ----------
    stage : Usd.Stage
    kept : collection of str
        Paths of those that are read (`usdface.io.usd.groups`).
    """
    # Prototypes of instancers are not shown where they stand.
    shown = prims_without(stage.GetPseudoRoot(), UsdGeom.PointInstancer)
    groups = (str(prim.GetPath()) for prim in shown if _is_empty(prim))
    empty = [path for path in groups if path not in kept]
    if not empty:
        return []
    where = stage_name(stage)
    message = "{node_count} Xforms that carry nothing are left out: {nodes}"
    return [finding("NODES_DROPPED", where, message, len(empty), empty)]


def _is_empty(prim: Usd.Prim) -> bool:
    below = (each.GetTypeName() in ("Xform", "Scope") for each in Usd.PrimRange(prim, _ALL))
    return prim.GetTypeName() == "Xform" and all(below)
