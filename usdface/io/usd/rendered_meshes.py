"""The rendered meshes of a stage, and findings on prims that are not converted."""

from collections.abc import Collection, Iterable

from pxr import Usd, UsdGeom, UsdMedia, UsdSkel

from usdface.findings import Finding, finding
from usdface.io.usd.attributes import changes
from usdface.io.usd.prim_walks import lineage, prims_without

__all__ = [
    "outside_meshes",
    "placed_meshes",
    "placed_roots",
    "rendered_meshes",
    "report_unconverted",
    "visibility_changes",
]

_ALL = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)
_START = Usd.TimeCode.EarliestTime()
_UNSEEN = (UsdGeom.Tokens.guide, UsdGeom.Tokens.proxy)  # purposes that a render leaves out
_OURS = "UsdFace"  # prims of usdface: a take is no part of the picture


def rendered_meshes(
    prims: Iterable[Usd.Prim], purposes: Collection[str] = ()
) -> tuple[list[Usd.Prim], list[Finding]]:
    """Return the meshes that a render shows at the first time, and those of `purposes`.

    Left out are guides, proxies where render meshes exist, and invisible meshes; where nothing is
    visible all are kept, rather than write an empty file. Each is reported.

    Source: OpenUSD, UsdGeomImageable (purpose, visibility).
    """
    meshes = list(prims)
    computed = {prim: UsdGeom.Imageable(prim).ComputePurpose() for prim in meshes}
    visible = {p: UsdGeom.Imageable(p).ComputeVisibility(_START) != "invisible" for p in meshes}
    rendered = any(
        visible[p] and computed[p] in (UsdGeom.Tokens.default_, UsdGeom.Tokens.render)
        for p in meshes
    )
    shown, found = [], []
    for prim in meshes:
        where, purpose = str(prim.GetPath()), computed[prim]
        hidden = "" if visible[prim] else "it is invisible"
        if purpose in _UNSEEN and purpose not in purposes:
            hidden = hidden or f"its purpose is {purpose}"
        if not hidden:
            shown.append(prim)
        elif rendered:
            found.append(
                finding("FEATURE_DROPPED", where, f"the mesh is left out: {hidden}", feature="mesh")
            )
        elif purpose != UsdGeom.Tokens.guide:
            message = f"the mesh is shown although {hidden}: there is no other"
            found.append(finding("FEATURE_APPROXIMATED", where, message, feature="visibility"))
            shown.append(prim)
        if visibility_changes(prim):
            message = "its visibility changes over time; it stays as at the first"
            found.append(finding("ANIMATION_DROPPED", where, message))
    return shown, found


def placed_roots(top: Usd.Prim) -> list[Usd.Prim]:
    """Return the SkelRoots under a prim that are shown where they are.

    Prototypes of instancers are not; where there are only these, all are returned.
    """
    roots = [prim for prim in Usd.PrimRange(top, _ALL) if prim.IsA(UsdSkel.Root)]
    return [root for root in roots if not _is_prototype(root)] or roots


def placed_meshes(root: Usd.Prim) -> list[Usd.Prim]:
    """Return the meshes under a SkelRoot without prototypes of instancers."""
    return [p for p in prims_without(root, UsdGeom.PointInstancer) if p.IsA(UsdGeom.Mesh)]


def _is_prototype(prim: Usd.Prim) -> bool:
    return any(each.IsA(UsdGeom.PointInstancer) for each in lineage(prim))


def outside_meshes(stage: Usd.Stage) -> list[Usd.Prim]:
    """Return the meshes outside of every SkelRoot, which no blend shape and no joint moves."""
    # Prototypes of instancers are not shown where they stand.
    shown = prims_without(stage.GetPseudoRoot(), UsdSkel.Root, UsdGeom.PointInstancer)
    return [prim for prim in shown if prim.IsA(UsdGeom.Mesh)]


def visibility_changes(prim: Usd.Prim) -> bool:
    """Return whether a prim, or one above it, may be shown at some times only."""
    imageables = (UsdGeom.Imageable(each) for each in lineage(prim))
    return any(each and changes(each.GetVisibilityAttr()) for each in imageables)


def report_unconverted(stage: Usd.Stage) -> list[Finding]:
    """Return a finding for each shape that is no mesh, and each sound."""
    found = []
    prims = iter(Usd.PrimRange(stage.GetPseudoRoot(), _ALL))
    for prim in prims:
        kind, where = prim.GetTypeName(), str(prim.GetPath())
        if prim.IsA(UsdGeom.PointInstancer):
            prims.PruneChildren()  # prototypes are not shown where they stand
            count = len(UsdGeom.PointInstancer(prim).GetProtoIndicesAttr().Get(_START) or ())
            message = (
                "a PointInstancer of {instance_count} instances is left out: meshes are converted"
            )
            found.append(
                finding("FEATURE_DROPPED", where, message, count, feature="point_instancer")
            )
        elif prim.IsA(UsdGeom.Gprim) and not prim.IsA(UsdGeom.Mesh) and not kind.startswith(_OURS):
            message = "a {type} is left out: meshes are converted"
            found.append(finding("FEATURE_DROPPED", where, message, kind, feature="geometry"))
        elif prim.IsA(UsdMedia.SpatialAudio):
            message = "sound is left out: a glTF and a rig have none"
            found.append(finding("FEATURE_DROPPED", where, message, feature="sound"))
    return found
