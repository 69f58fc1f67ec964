"""Data of a stage that a rig has no place for: attributes, metadata, variants, skeletons."""

from collections.abc import Collection, Iterable, Iterator

from pxr import Sdf, Usd, UsdGeom, UsdLux, UsdMedia, UsdShade, UsdSkel

from usdface.findings import Finding, finding
from usdface.io.usd.attributes import changes
from usdface.io.usd.extras import USER_PROPERTIES, read_extras
from usdface.io.usd.prim_walks import prims_without
from usdface.io.usd.stage import stage_name
from usdface.io.usd.variant_stages import stage_with_variant

__all__ = [
    "report_lost_groups",
    "report_other_prims",
    "report_unbound_skeletons",
    "report_unconverted_data",
    "report_unconverted_variants",
]

_ALL = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)
# Prims and attributes of a take and its result, which are no part of the picture.
_OUR_TYPES, _OURS = "UsdFace", "usdface:"
# Those of a kind that is not converted are reported by their readers.
_TYPES = (
    *(UsdGeom.Scope, UsdGeom.Xform, UsdGeom.Camera, UsdGeom.Gprim, UsdGeom.PointInstancer),
    *(UsdGeom.Subset, UsdMedia.SpatialAudio, UsdShade.Material, UsdShade.NodeGraph),
    *(UsdShade.Shader, UsdSkel.Root, UsdSkel.Skeleton, UsdSkel.Animation, UsdSkel.BlendShape),
)
# Of USD's own schemas, also on a prim that does not apply one: what is not read of these is
# reported by their readers. `ui:` is how an editor lays nodes out; an extent is computed.
_OF_SCHEMAS = (
    *("material:", "primvars:", "skel:", "xformOp:", "inputs:", "outputs:", "inbetweens:"),
    *("subsetFamily:", "ui:", "extent"),
)
# What Blender, Maya and Houdini note on each prim that they write: their own names of it, and that
# they made it. Nobody misses it, and it would hide what somebody does.
_NOTES_OF_EXPORTERS = ("userProperties:blender:", "userProperties:blenderName:", "Houdini")
# Metadata of a prim for people.
_NOTES = ("assetInfo", "comment", "documentation")
_MADE = {"generated": True}  # customData of Blender and Maya, below a key of their name
_MATERIALS = "material"  # the set that becomes material variants of glTF


def report_unconverted_data(stage: Usd.Stage, kept: Collection[str], top: str) -> list[Finding]:
    """Return CHANNEL_IGNORED for attributes of no schema, customData and notes that nothing keeps.

    Parameters
    ----------
    stage : Usd.Stage
    kept : collection of str
        Paths of prims whose extras are read, beside cameras, lights and materials.
    top : str
        Path of the prim whose assetInfo is read.
    """
    prims = list(stage.Traverse(_ALL))
    lost = [name for prim in prims for name in _unread(prim, kept)]
    lost += [
        f"{prim.GetPath()} {key}"
        for prim in prims
        for key in _NOTES
        if prim.HasAuthoredMetadata(key) and (key, str(prim.GetPath())) != ("assetInfo", top)
    ]
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
    known = prim.GetPrimDefinition()
    for each in prim.GetAuthoredProperties():
        name = each.GetName()
        if known.GetPropertyDefinition(name):
            continue
        if name.startswith((_OURS, *_OF_SCHEMAS, *_NOTES_OF_EXPORTERS)):
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


def report_unconverted_variants(
    stage: Usd.Stage, materials: bool = True, clips: bool = True
) -> list[Finding]:
    """Return FEATURE_DROPPED for variants of a stage that are neither `clips` nor `materials`.

    Of those only the selected one is converted. Where a set chooses between animations its
    variants are clips (`usdface.io.usd.clip_variants`). The stage is not changed.
    """
    lost = [
        f"{prim.GetPath()} {name}={chosen or 'none'}"
        for prim in stage.Traverse(_ALL)
        for name, chosen in _sets(prim)
        if not (materials and name == _MATERIALS and prim == stage.GetDefaultPrim())
        and not (clips and _chooses_animation(stage, prim, name, chosen))
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


def report_other_prims(stage: Usd.Stage) -> list[Finding]:
    """Return CHANNEL_IGNORED for prims of types that are neither read nor reported elsewhere."""
    lost = [
        f"{prim.GetTypeName()} {prim.GetPath()}"
        for prim in stage.Traverse(_ALL)
        if prim.GetTypeName() and not _is_known(prim)
    ]
    if not lost:
        return []
    where = stage_name(stage)
    message = "prims of types that usdface does not read: {channels}"
    return [finding("CHANNEL_IGNORED", where, message, lost)]


def _is_known(prim: Usd.Prim) -> bool:
    if str(prim.GetTypeName()).startswith(_OUR_TYPES) or prim.HasAPI(UsdLux.LightAPI):
        return True
    return any(map(prim.IsA, _TYPES))


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


def report_lost_groups(stage: Usd.Stage, kept: Collection[str]) -> list[Finding]:
    """Return NODES_DROPPED for Xforms that become nothing.

    Those with nothing below but such, as locators and sockets; and those above meshes of other
    names, as of objects in Blender, unless they are above a SkelRoot.

    Parameters
    ----------
    stage : Usd.Stage
    kept : collection of str
        Paths of those that are read (`usdface.io.usd.groups`).
    """
    empty, others = [], []
    prims = list(stage.Traverse(_ALL))
    above = _and_above(prim for prim in prims if prim.IsA(UsdSkel.Root))
    carrying = _and_above(prim for prim in prims if prim.GetTypeName() not in ("Xform", "Scope"))
    over_meshes = _and_above(prim for prim in prims if prim.IsA(UsdGeom.Mesh))
    # Prototypes of instancers are not shown where they stand.
    for prim in prims_without(stage.GetPseudoRoot(), UsdGeom.PointInstancer):
        path = prim.GetPath()
        if prim.GetTypeName() != "Xform" or str(path) in kept:
            continue
        if path not in carrying:
            empty.append(str(path))
        elif path in over_meshes and path not in above and not _holds_namesake(prim):
            others.append(str(path))
    messages = {
        "{node_count} Xforms that carry nothing are left out: {nodes}": empty,
        "of {node_count} Xforms only the contents are kept: {nodes}": others,
    }
    return [
        finding("NODES_DROPPED", stage_name(stage), message, len(paths), paths)
        for message, paths in messages.items()
        if paths
    ]


def _holds_namesake(prim: Usd.Prim) -> bool:
    return prim.GetName() in prim.GetAllChildrenNames()


def _and_above(prims: Iterable[Usd.Prim]) -> set[Sdf.Path]:
    """Return the paths of prims and of all that are above them, each visited once."""
    found = {Sdf.Path.absoluteRootPath}
    for prim in prims:
        path = prim.GetPath()
        while path not in found:
            found.add(path)
            path = path.GetParentPath()
    return found
