"""Checks of the requirements of UsdSkel for blend shapes: SkelRoot, schema, skeleton, names.

Each of these faults leaves a stage that validates and stands still.

Source: OpenUSD, UsdSkel schema documentation ("Binding Skeletons", "Blend Shapes"); observed
behaviour of `UsdSkel.Cache` in 26.11.
"""

from collections.abc import Iterator

from pxr import Usd, UsdGeom, UsdSkel

from usdface.errors import did_you_mean
from usdface.findings import Finding, finding
from usdface.findings.values import Prose
from usdface.io.usd.instances import shown_path
from usdface.io.usd.prim_walks import lineage

__all__ = ["check_bindings"]

_ALL = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)
Findings = Iterator[Finding]


def check_bindings(stage: Usd.Stage) -> Findings:
    """Check that UsdSkel finds everything that the blend shapes of a stage are bound to."""
    for prim in Usd.PrimRange(stage.GetPseudoRoot(), _ALL):
        if prim.IsA(UsdGeom.Mesh) and prim.GetAttribute("skel:blendShapes").Get():
            yield from _can_play(prim)
        elif _is_bound(prim) and not prim.HasAPI(UsdSkel.BindingAPI):
            yield _not_applied(prim)
    yield from _names_are_those_of_meshes(stage)


def _can_play(mesh: Usd.Prim) -> Findings:
    where = str(mesh.GetPath())
    if not UsdSkel.Root.Find(mesh):
        if not UsdGeom.Mesh(mesh).GetPointsAttr().ValueMightBeTimeVarying():  # else it is baked
            yield finding("SKELROOT_MISSING", where)
    elif not mesh.HasAPI(UsdSkel.BindingAPI):
        yield _not_applied(mesh)
    elif not UsdSkel.BindingAPI(mesh).GetInheritedSkeleton() and not _names_a_skeleton(mesh):
        yield finding("SKELETON_MISSING", where)


def _not_applied(prim: Usd.Prim) -> Finding:
    names = sorted(filter(_of_skel, prim.GetAuthoredPropertyNames()))
    message = "SkelBindingAPI is not applied; UsdSkel ignores {attributes}"
    return finding("SCHEMA_UNAPPLIED", str(prim.GetPath()), message, names)


def _is_bound(prim: Usd.Prim) -> bool:
    return any(map(_of_skel, prim.GetAuthoredPropertyNames()))


def _of_skel(name: str) -> bool:
    return name.startswith(("skel:", "primvars:skel:"))


def _names_a_skeleton(prim: Usd.Prim) -> bool:
    """Whether a prim or one above names a skeleton, be it there or not, which is another fault."""
    relations = (each.GetRelationship("skel:skeleton") for each in lineage(prim))
    return any(relation and relation.GetForwardedTargets() for relation in relations)


def _names_are_those_of_meshes(stage: Usd.Stage) -> Findings:
    """Compare the shapes that an animation names with those of the meshes that it moves."""
    cache = UsdSkel.Cache()
    moved: dict[Usd.Prim, dict[str, None]] = {}
    places: dict[Usd.Prim, str] = {}
    for root in filter(None, map(UsdSkel.Root, Usd.PrimRange(stage.GetPseudoRoot(), _ALL))):
        cache.Populate(root, _ALL)
        for binding in cache.ComputeSkelBindings(root, _ALL):
            query = cache.GetSkelQuery(binding.GetSkeleton()).GetAnimQuery()
            if query:
                names = moved.setdefault(query.GetPrim(), {})
                place = shown_path(query.GetPrim(), binding.GetSkeleton().GetPrim())
                places.setdefault(query.GetPrim(), str(place))
                for target in binding.GetSkinningTargets():
                    shapes = UsdSkel.BindingAPI(target.GetPrim()).GetBlendShapesAttr().Get() or ()
                    names |= dict.fromkeys(map(str, shapes))
    for animation, known in moved.items():
        given = list(map(str, UsdSkel.Animation(animation).GetBlendShapesAttr().Get() or ()))
        unknown = [name for name in given if name not in known]
        where = places[animation]
        if unknown and known and len(unknown) == len(given):
            message = "names no blend shape of the meshes that it moves: {shapes}{hint}"
            hint = Prose(did_you_mean(unknown[0], known))
            yield finding("ANIMATION_UNMATCHED", where, message, unknown, hint)
        elif unknown and known:
            message = "{shape!r} is on no mesh that it moves{more}{hint}"
            hint = Prose(did_you_mean(unknown[0], known))
            more = Prose(f", and {len(unknown) - 1} others" if unknown[1:] else "")
            count = len(unknown)
            yield finding(
                "SHAPE_UNKNOWN", where, message, unknown[0], more, hint, shape_count=count
            )
