"""Clips of a stage: the bound SkelAnimations, and variants that bind others."""

from dataclasses import dataclass

import numpy as np
from pxr import Sdf, Usd, UsdSkel

from usdface.content_digest import content_digest
from usdface.findings import Finding, finding
from usdface.io.usd.instances import shown_path
from usdface.io.usd.prim_walks import lineage
from usdface.io.usd.rendered_meshes import placed_roots
from usdface.io.usd.skel_bindings import skel_roots
from usdface.io.usd.variant_stages import stage_with_variant
from usdface.schemas import tokens

__all__ = [
    "BoundAnimation",
    "bound_animations",
    "clip_stages",
    "clips_and_losses",
    "playing_animations",
    "report_unbound",
]

_ALL = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)
_NAMES = ("joints", "blendShapes")
_SAMPLED = ("translations", "rotations", "scales", "blendShapeWeights")


@dataclass(frozen=True, slots=True)
class BoundAnimation:
    """A skeleton and the SkelAnimation that moves it.

    The prim of the queries is one that all instances share; `prim` is where the skeleton stands.
    """

    prim: Usd.Prim
    skeleton: UsdSkel.SkeletonQuery
    animation: UsdSkel.AnimQuery

    @property
    def path(self) -> Sdf.Path:
        """The path of the SkelAnimation on the stage."""
        return shown_path(self.animation.GetPrim(), self.prim)


def clip_stages(stage: Usd.Stage) -> list[Usd.Stage]:
    """Return the stage with each of its clips bound; the authored selection comes first.

    A variant set of a SkelRoot, or of a prim above it, whose variants bind different SkelAnimations
    chooses between clips; where there is none the stage itself is all. The stage is not changed.
    """
    return clips_and_losses(stage)[0]


def clips_and_losses(stage: Usd.Stage) -> tuple[list[Usd.Stage], list[Finding]]:
    """Return `clip_stages`, and ANIMATION_DROPPED for variants with another clip at one path."""
    roots = skel_roots(stage)
    above = (prim for root in roots for prim in lineage(root.GetParent()))
    choosing = dict.fromkeys([*roots, *above])
    choices = [(prim, *each) for prim in choosing for each in _unselected(prim)]
    if not choices:
        return [stage], []
    known = {playing_animations(stage): (stage, _content(stage))}
    skeletons = _skeletons(stage)
    places = {prim.GetPath(): k for k, prim in enumerate(stage.Traverse(_ALL))}
    lost: dict[tuple[Sdf.Path, ...], list[str]] = {}
    for prim, name, variant in choices:
        other = stage_with_variant(stage, prim.GetPath(), name, variant)
        if not placed_roots(other.GetPseudoRoot()):  # a proxy, or an empty variant: no clip
            continue
        # Above a SkelRoot a set may choose between characters, which are no clips of one.
        if prim not in roots and not _skeletons(other) <= skeletons:
            continue
        paths, digest = playing_animations(other), _content(other)
        if known.setdefault(paths, (other, digest))[1] != digest:
            lost.setdefault(paths, []).append(f"{name}={variant}")
    order = sorted(known, key=lambda paths: [places.get(path, len(places)) for path in paths])
    clips = [known[paths][0] for paths in order if paths and known[paths][0] is not stage]
    message = (
        "it is another one in the variants {variants}, of the same path; converted is the one that "
        "the stage shows"
    )
    findings = [
        finding("ANIMATION_DROPPED", str(paths[0]), message, names) for paths, names in lost.items()
    ]
    return [stage, *clips], findings


def _unselected(prim: Usd.Prim) -> list[tuple[str, str]]:
    """Return the variant sets of a prim with each variant that is not selected."""
    if prim.IsInstanceProxy():
        return []
    sets = prim.GetVariantSets()
    return [
        (name, variant)
        for name in sets.GetNames()
        for variant in sets.GetVariantSet(name).GetVariantNames()
        if variant != sets.GetVariantSelection(name)
    ]


def _content(stage: Usd.Stage) -> str:
    """Return a digest of the samples of the bound SkelAnimations."""
    parts: list[object] = []
    for bound in bound_animations(stage):
        prim = bound.animation.GetPrim()
        parts += [[*map(str, prim.GetAttribute(name).Get() or ())] for name in _NAMES]
        for attribute in map(prim.GetAttribute, _SAMPLED):
            codes = attribute.GetTimeSamples()
            parts += [codes, [np.array(attribute.Get(code)) for code in codes]]
    return content_digest(parts)


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
                prim = binding.GetSkeleton().GetPrim()
                bound = BoundAnimation(prim, query, query.GetAnimQuery())
                found.setdefault(prim.GetPath(), bound)
    return list(found.values())


def playing_animations(stage: Usd.Stage) -> tuple[Sdf.Path, ...]:
    """Return the paths of the bound SkelAnimations."""
    return tuple(dict.fromkeys(bound.path for bound in bound_animations(stage)))


def report_unbound(stage: Usd.Stage, played: set[Sdf.Path]) -> list[Finding]:
    """Return ANIMATION_DROPPED for each animation that no variant binds, but for takes of shots."""
    prims = list(Usd.PrimRange(stage.GetPseudoRoot(), _ALL))  # libraries stand beside characters
    takes = (prim.GetRelationship(tokens.TAKE) for prim in prims)
    played = played | {path for take in takes if take for path in take.GetForwardedTargets()}
    message = "nothing on the stage binds it, in no variant"
    return [
        finding("ANIMATION_DROPPED", str(prim.GetPath()), message)
        for prim in prims
        if prim.IsA(UsdSkel.Animation)
        and prim.GetPath() not in played
        and (_is_pose(prim) or any(a.ValueMightBeTimeVarying() for a in prim.GetAttributes()))
    ]


def _is_pose(animation: Usd.Prim) -> bool:
    """Return whether a SkelAnimation holds weights that are not 0, or joints, without samples."""
    *joints, weights = (animation.GetAttribute(name).Get() for name in _SAMPLED)
    return any(weights or ()) or any(map(bool, joints))
