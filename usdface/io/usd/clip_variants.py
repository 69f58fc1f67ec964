"""Clips of a stage: the bound SkelAnimations, and variants that bind others."""

from collections.abc import Iterator
from dataclasses import dataclass

from pxr import Sdf, Usd, UsdSkel

from usdface.findings import Finding, finding
from usdface.io.usd.held_layers import hold_layers
from usdface.io.usd.rig import skel_roots
from usdface.io.usd.stage import check_clocks

__all__ = [
    "BoundAnimation",
    "bound_animations",
    "clip_stages",
    "playing_animations",
    "report_unbound",
]

_ALL = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)


@dataclass(frozen=True, slots=True)
class BoundAnimation:
    """A skeleton and the SkelAnimation that moves it."""

    skeleton: UsdSkel.SkeletonQuery
    animation: UsdSkel.AnimQuery


def clip_stages(stage: Usd.Stage) -> Iterator[Usd.Stage]:
    """Yield the stage with each of its clips bound; the authored selection comes first.

    A variant set of a SkelRoot, or of a prim above it, whose variants bind different SkelAnimations
    chooses between clips; where there is none the stage itself is all. The stage is not changed.
    """
    yield stage
    seen = {playing_animations(stage)}
    skeletons = _skeletons(stage)
    places = {prim.GetPath(): k for k, prim in enumerate(stage.Traverse(_ALL))}
    others: dict[tuple[Sdf.Path, ...], Usd.Stage] = {}
    roots = skel_roots(stage)
    for prim in dict.fromkeys([*roots, *(above for each in roots for above in _above(each))]):
        if prim.IsInstanceProxy():
            continue
        sets = prim.GetVariantSets()
        for name in sets.GetNames():
            for variant in sets.GetVariantSet(name).GetVariantNames():
                session = Sdf.Layer.CreateAnonymous(".usda")
                session.TransferContent(stage.GetSessionLayer())
                spec = Sdf.CreatePrimInLayer(session, prim.GetPath())
                spec.variantSelections[name] = variant
                other = Usd.Stage.Open(stage.GetRootLayer(), session)
                hold_layers(other)
                check_clocks(other)
                # Above a SkelRoot a set may choose between characters, which are no clips of one.
                if prim in roots or _skeletons(other) <= skeletons:
                    others.setdefault(playing_animations(other), other)
    order = sorted(others, key=lambda paths: [places.get(path, len(places)) for path in paths])
    for paths in order:
        if paths and paths not in seen:
            yield others[paths]


def _above(prim: Usd.Prim) -> Iterator[Usd.Prim]:
    """Yield the prims above one, from the nearest on."""
    while (prim := prim.GetParent()) and not prim.IsPseudoRoot():
        yield prim


def _skeletons(stage: Usd.Stage) -> set[Sdf.Path]:
    """Return the paths of the skeletons."""
    return {prim.GetPath() for prim in stage.Traverse(_ALL) if prim.IsA(UsdSkel.Skeleton)}


def bound_animations(stage: Usd.Stage) -> list[BoundAnimation]:
    """Return the skeletons with a SkelAnimation, in the order of the stage."""
    cache = UsdSkel.Cache()
    found: dict[Sdf.Path, BoundAnimation] = {}
    for skel_root in map(UsdSkel.Root, skel_roots(stage)):
        cache.Populate(skel_root, _ALL)
        for binding in cache.ComputeSkelBindings(skel_root, _ALL):
            query = cache.GetSkelQuery(binding.GetSkeleton())
            if query.GetAnimQuery():
                path = binding.GetSkeleton().GetPath()
                found.setdefault(path, BoundAnimation(query, query.GetAnimQuery()))
    return list(found.values())


def playing_animations(stage: Usd.Stage) -> tuple[Sdf.Path, ...]:
    """Return the paths of the bound SkelAnimations."""
    return tuple(dict.fromkeys(b.animation.GetPrim().GetPath() for b in bound_animations(stage)))


def report_unbound(stage: Usd.Stage, played: set[Sdf.Path]) -> list[Finding]:
    """Return ANIMATION_DROPPED for each animation that no variant binds."""
    prims = dict.fromkeys(p for r in skel_roots(stage) for p in Usd.PrimRange(r, _ALL))
    message = "nothing on the stage binds it, in no variant"
    return [
        finding("ANIMATION_DROPPED", str(prim.GetPath()), message)
        for prim in prims
        if prim.IsA(UsdSkel.Animation)
        and not {prim.GetPath(), _shared_path(prim)} & played
        and any(attribute.ValueMightBeTimeVarying() for attribute in prim.GetAttributes())
    ]


def _shared_path(prim: Usd.Prim) -> Sdf.Path:
    """Return the path of the prim that all instances share, where it is one of an instance."""
    return (prim.GetPrimInPrototype() if prim.IsInstanceProxy() else prim).GetPath()
