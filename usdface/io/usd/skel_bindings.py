"""UsdSkel bindings of the meshes of a stage: SkelRoots, skeletons and bind spaces."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdSkel

from usdface.arrays import FloatArray
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.usd.head_motion import inverse_head_motion
from usdface.io.usd.metrics import metrics_of, to_si
from usdface.io.usd.rendered_meshes import outside_meshes, placed_meshes, placed_roots
from usdface.io.usd.skeleton import read_skeleton
from usdface.io.usd.skeletons import StagedSkeleton, join_skeletons
from usdface.rigs import Skeleton
from usdface.schemas import tokens

__all__ = [
    "BoundMesh",
    "active_skeleton",
    "active_source",
    "bind_space",
    "meshes_below",
    "read_skeletons",
    "skel_bindings",
    "skel_roots",
    "skeleton_of_meshes",
    "skinned_by",
    "spaces_of_meshes",
    "staged_skeletons",
]

_START = Usd.TimeCode.EarliestTime()
_ALL = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)


@dataclass(frozen=True, slots=True)
class BoundMesh:
    """The UsdSkel binding of one mesh."""

    skeleton: Usd.Prim
    query: UsdSkel.SkinningQuery
    skinned: bool


def active_skeleton(mesh: Usd.Prim) -> Usd.Prim | None:
    """Return the skeleton that a mesh is bound to; UsdSkel moves nothing by an inactive one."""
    skeleton = UsdSkel.BindingAPI(mesh).GetInheritedSkeleton()
    return skeleton.GetPrim() if skeleton and skeleton.GetPrim().IsActive() else None


def active_source(skeleton: Usd.Prim) -> Usd.Prim | None:
    """Return the SkelAnimation that a skeleton plays; UsdSkel plays no inactive one."""
    source = UsdSkel.BindingAPI(skeleton).GetInheritedAnimationSource()
    return source if source and source.IsActive() else None


def skel_roots(stage: Usd.Stage, root: str = "") -> list[Usd.Prim]:
    """Return the SkelRoots under `root`, or the one that it is under.

    Raises
    ------
    InputError
        If there is no such prim or SkelRoot.
    """
    top = stage.GetPseudoRoot()
    if root:
        top = stage.GetPrimAtPath(root) if Sdf.Path.IsValidPathString(root)[0] else None
        if not top:
            raise InputError(f"the stage has no prim {root}; name the SkelRoot of the face")
        above = UsdSkel.Root.Find(top)
        if above:
            return [above.GetPrim()]
    roots = placed_roots(top)
    if not roots:
        raise InputError(_no_root(top, root), "FACE_MISSING")
    return roots


def _no_root(top: Usd.Prim, root: str) -> str:
    """Return the message for a stage without a SkelRoot."""
    if any(prim.GetTypeName() == tokens.MARKER_TAKE for prim in Usd.PrimRange(top)):
        return "it holds a marker take; expected a character with blend shapes"
    return (
        f"no SkelRoot{f' under {root}' if root else ''}; UsdSkel moves blend shapes only below "
        "one: export the character as UsdSkel, or as glTF"
    )


def meshes_below(roots: Sequence[Usd.Prim]) -> list[Usd.Prim]:
    """Return the meshes below SkelRoots, each once."""
    return list(dict.fromkeys(prim for root in roots for prim in placed_meshes(root)))


def skel_bindings(
    roots: list[Usd.Prim],
) -> tuple[dict[Sdf.Path, BoundMesh], list[Usd.Prim]]:
    """Return how each mesh below SkelRoots is bound, by its path, and the skeletons."""
    cache = UsdSkel.Cache()
    bound: dict[Sdf.Path, BoundMesh] = {}
    skeletons: dict[Usd.Prim, None] = {}
    for root in map(UsdSkel.Root, roots):
        cache.Populate(root, _ALL)
        for binding in cache.ComputeSkelBindings(root, _ALL):
            skeleton = binding.GetSkeleton()
            skeletons[skeleton.GetPrim()] = None
            has_joints = bool(skeleton.GetJointsAttr().Get())
            for query in binding.GetSkinningTargets():
                skinned = has_joints and query.HasJointInfluences()
                path = query.GetPrim().GetPath()
                bound[path] = BoundMesh(skeleton.GetPrim(), query, skinned)
    return bound, list(skeletons)


def staged_skeletons(stage: Usd.Stage) -> tuple[StagedSkeleton, ...]:
    """Return the skeletons that `rig_of_stage` joins, and the new names of their joints."""
    _, skeletons = skel_bindings(skel_roots(stage))
    xforms, si = UsdGeom.XformCache(_START), to_si(metrics_of(stage))
    given, _ = read_skeletons(skeletons, xforms, si, joints=False, single=False)
    return join_skeletons(given)[1]


def skinned_by(stage: Usd.Stage) -> dict[str, Usd.Prim]:
    """Return the skeleton of each mesh that has a skin, by the mesh's path.

    Also one that the rig omits because it moves nothing: the transform of the mesh is ignored
    nevertheless.
    """
    bound, _ = skel_bindings(skel_roots(stage))
    return {str(path): binding.skeleton for path, binding in bound.items() if binding.skinned}


def skeleton_of_meshes(stage: Usd.Stage) -> dict[str, Sdf.Path]:
    """Return the skeleton that each mesh is bound to, by the mesh's path."""
    bound, _ = skel_bindings(skel_roots(stage))
    return {str(path): binding.skeleton.GetPath() for path, binding in bound.items()}


def spaces_of_meshes(stage: Usd.Stage) -> dict[str, FloatArray]:
    """Return the transform (4, 4) from the points of each mesh to rig space, by its path."""
    roots = skel_roots(stage)
    bound, _ = skel_bindings(roots)
    si, xforms = to_si(metrics_of(stage)), UsdGeom.XformCache(_START)
    return {
        str(prim.GetPath()): bind_space(prim, bound.get(prim.GetPath()), xforms) @ si
        for prim in (*meshes_below(roots), *outside_meshes(stage))
    }


def read_skeletons(
    skeletons: list[Usd.Prim],
    xforms: UsdGeom.XformCache,
    si: FloatArray,
    joints: bool,
    single: bool,
) -> tuple[list[tuple[Sdf.Path, Skeleton]], list[Finding]]:
    """Return the skeletons that move anything; of a character, a `single` one."""
    given: list[tuple[Sdf.Path, Skeleton]] = []
    findings: list[Finding] = []
    for prim in skeletons:
        to_rig = _world(prim, xforms) @ si
        moved = joints or _is_moved(prim)
        skeleton, new_findings = read_skeleton(UsdSkel.Skeleton(prim), to_rig, moved)
        findings += new_findings
        if skeleton and given and single:
            message = "a character keeps one skeleton; meshes bound to this one are not skinned"
            findings.append(
                finding("FEATURE_DROPPED", str(prim.GetPath()), message, feature="skeleton")
            )
        elif skeleton:
            given.append((prim.GetPath(), skeleton))
    return given, findings


def _is_moved(skeleton: Usd.Prim) -> bool:
    """Whether some SkelAnimation beside the skeleton, bound or not, moves one of its joints."""
    joints = set(UsdSkel.Skeleton(skeleton).GetJointsAttr().Get() or ())
    root = UsdSkel.Root.Find(skeleton)
    for animation in map(UsdSkel.Animation, Usd.PrimRange(root.GetPrim(), _ALL) if root else ()):
        if animation and joints & set(animation.GetJointsAttr().Get() or ()):
            moves = animation.GetTranslationsAttr(), animation.GetRotationsAttr()
            if any(a.GetNumTimeSamples() > 1 for a in (*moves, animation.GetScalesAttr())):
                return True
            if any(not np.allclose(m, np.eye(4)) for m in animation.GetTransforms(_START) or ()):
                return True
    return False


def _world(prim: Usd.Prim, xforms: UsdGeom.XformCache) -> FloatArray:
    """Return the world transform of a prim without an authored head motion of usdface."""
    root = UsdSkel.Root.Find(prim)
    matrix = _matrix(xforms.GetLocalToWorldTransform(prim))
    return matrix @ inverse_head_motion(root.GetPrim()) if root else matrix


def _matrix(value: object) -> FloatArray:
    matrix = np.array(value, np.float64).reshape(4, 4)
    if not np.isfinite(matrix).all():
        raise InputError("a transform has numbers that are not finite", "VALUES_WRONG")
    return matrix


def bind_space(prim: Usd.Prim, bound: BoundMesh | None, xforms: UsdGeom.XformCache) -> FloatArray:
    """Return the transform (4, 4) from a mesh's points to where its bind pose stands [stage]."""
    if bound is None or not bound.skinned:
        return _world(prim, xforms)
    skeleton = _world(bound.skeleton, xforms)
    return _matrix(bound.query.GetGeomBindTransform(_START)) @ skeleton
