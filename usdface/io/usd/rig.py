"""Rigs from USD: any UsdSkel asset as meshes in metres, Y up, right-handed."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdSkel

from usdface.arrays import FloatArray
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.usd.errors import usd_errors
from usdface.io.usd.extras import read_asset, read_extras
from usdface.io.usd.groups import paths_of_groups, read_groups
from usdface.io.usd.head_motion import inverse_head_motion
from usdface.io.usd.material_variants import read_material_variants
from usdface.io.usd.materials import read_mesh_materials, report_unbound_materials
from usdface.io.usd.mesh import read_mesh
from usdface.io.usd.mixed_metrics import report_mixed_metrics
from usdface.io.usd.rendered_meshes import (
    outside_meshes,
    placed_meshes,
    placed_roots,
    rendered_meshes,
    report_unconverted,
)
from usdface.io.usd.scene import read_scene
from usdface.io.usd.skeleton import read_skeleton, read_skin
from usdface.io.usd.skeletons import StagedSkeleton, join_skeletons
from usdface.io.usd.stage import metrics_of, missing_metrics, open_stage, to_si
from usdface.io.usd.unconverted_data import (
    report_empty_groups,
    report_unbound_skeletons,
    report_unconverted_data,
    report_unconverted_variants,
)
from usdface.io.usd.unconverted_mesh_parts import report_unconverted_parts
from usdface.io.usd.vertex_cache import points_move
from usdface.rigs import Mesh, Rig, Skeleton, Skin
from usdface.schemas import tokens

__all__ = [
    "read_rig",
    "rig_of_stage",
    "skel_roots",
    "skeleton_of_meshes",
    "skinned_by",
    "spaces_of_meshes",
    "staged_skeletons",
]

_ALL = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)
_START = Usd.TimeCode.EarliestTime()


@dataclass(frozen=True, slots=True)
class _Bound:
    """How UsdSkel binds one mesh."""

    skeleton: Usd.Prim
    query: UsdSkel.SkinningQuery
    skinned: bool


def read_rig(path: Path, asset_root: Path | None = None) -> tuple[Rig, list[Finding]]:
    """Read the characters of a USD file (`rig_of_stage` of the whole stage).

    Raises
    ------
    InputError
        If the file cannot be read, or has no SkelRoot with a mesh.
    """
    return rig_of_stage(open_stage(path), asset_root=asset_root)


def rig_of_stage(
    stage: Usd.Stage,
    root: str = "",
    joints: bool = False,
    asset_root: Path | None = None,
    caches: bool = False,
    purposes: Collection[str] = (),
    turn: FloatArray | None = None,
    referenced: bool = False,
) -> tuple[Rig, list[Finding]]:
    """Return all meshes of an open stage that has SkelRoots as one rig.

    Those outside of the SkelRoots, too, unless `root` is given: nothing moves them but transforms.

    Points are where USD puts the bind pose: a skinned mesh in its skeleton's space by its
    geomBindTransform (its own transform does not count), another by its own transform; then
    in metres, Y up. Left-handed meshes, and those that a transform mirrors, have their faces
    turned. `Mesh.path` is the prim path, blend shape names are the tokens.

    Parameters
    ----------
    stage : Usd.Stage
    root : str
        Path of a prim that the meshes are under; "" = the whole stage.
    joints : bool
        Keep a skeleton that nothing moves yet.
    asset_root : Path, optional
        A folder that textures may come from beside those of their layers.
    caches : bool
        The caller reads points that change over time (`usdface.io.usd.vertex_cache`); else that
        they stay as at the first time is a finding.
    purposes : collection of str
        Also return meshes of these purposes, which a render does not show.
    turn : (4, 4) float64, optional
        A turn of the whole rig, after all others.
    referenced : bool
        The caller keeps the stage by a reference: parts of the scene that a rig has no place for
        are not lost, and not reported.

    Raises
    ------
    InputError
        If there is no such prim, SkelRoot or mesh, or a mesh makes no sense.

    References
    ----------
    OpenUSD, UsdSkel: "Skinning" and "Blend Shapes" of the schema documentation; behaviour of
    `UsdSkel.BakeSkinning` in 26.11 where they are silent.
    """
    with usd_errors(_source(stage)):
        si = to_si(metrics_of(stage)) @ (np.eye(4) if turn is None else turn)
        rig, findings = _rig(stage, root, joints, asset_root, purposes, si, referenced)
    for mesh in () if caches else rig.meshes:
        if points_move(UsdGeom.Mesh(stage.GetPrimAtPath(mesh.path))):
            message = "its points change over time; they stay as at the first"
            findings.append(finding("ANIMATION_DROPPED", mesh.path, message))
    return rig, findings


def _source(stage: Usd.Stage) -> str:
    return stage.GetRootLayer().realPath or "the stage"


def _rig(
    stage: Usd.Stage,
    root: str,
    joints: bool,
    asset_root: Path | None,
    purposes: Collection[str],
    si: FloatArray,
    referenced: bool,
) -> tuple[Rig, list[Finding]]:
    roots = skel_roots(stage, root)
    bound, skeletons = _bindings(roots)
    xforms = UsdGeom.XformCache(_START)
    given, findings = _read_skeletons(skeletons, xforms, si, joints, single=bool(root))
    skeleton, staged = join_skeletons(given)
    used = {one.path: one for one in staged}
    below = Sdf.Path(root) if root else Sdf.Path.absoluteRootPath
    meshes: list[Mesh] = []
    prims = [prim for prim in _meshes_of(roots) if prim.GetPath().HasPrefix(below)]
    outside = set() if root else set(outside_meshes(stage))
    if not root:  # a scene: visible prims only; a character may be hidden for now
        prims, new_findings = rendered_meshes([*prims, *outside_meshes(stage)], purposes)
        findings += new_findings + report_mixed_metrics(stage, prims)
    for prim in prims:
        binding = bound.get(prim.GetPath())
        skin: Skin | None = None
        own = used.get(binding.skeleton.GetPath()) if binding and binding.skinned else None
        if binding and own and skeleton:
            count = len(UsdGeom.Mesh(prim).GetPointsAttr().Get(_START) or ())
            skin, new_findings = read_skin(binding.query, count, own.skeleton.joints)
            findings += new_findings
            if skin is not None:
                skin = Skin(skin.joints + skeleton.joints.index(own.joints[0]), skin.weights)
        space = _bind_space(prim, binding, xforms) @ si
        mesh, new_findings = read_mesh(UsdGeom.Mesh(prim), space, skin)
        findings += new_findings
        if mesh and mesh.shapes and prim in outside:
            mesh = replace(mesh, shapes=())
            findings.append(finding("MESH_OUTSIDE", mesh.path))
        meshes += [mesh] if mesh else []
    if not meshes:
        raise InputError(f"no mesh with points under {root or roots[0].GetPath()}", "FACE_MISSING")
    looks = tuple(meshes) if root else read_material_variants(stage, meshes)
    named, materials, new_findings = read_mesh_materials(stage, looks, asset_root)
    top = stage.GetPrimAtPath(root) if root else stage.GetDefaultPrim() or roots[0]
    name = top.GetDisplayName() or top.GetName()
    source = stage.GetRootLayer().realPath
    rig = Rig(name, named, skeleton, materials, source)
    findings += new_findings
    if root:  # a character, not a scene
        return rig, findings
    cameras, lights, lost = read_scene(stage, si)
    extras, new_findings = read_extras(top)
    findings += new_findings
    asset, new_findings = read_asset(top)
    findings += new_findings
    groups, joint_extras, hung, new_findings = read_groups(stage, si, rig.meshes)
    if not referenced:
        findings += lost + _unconverted(stage, rig, top, skeletons)
        findings += report_unbound_materials(stage, looks)
    rig = replace(rig, cameras=cameras, lights=lights, extras=extras, asset=asset)
    rig = replace(rig, meshes=hung, groups=groups, joint_extras=joint_extras)
    return rig, findings + new_findings


def _unconverted(
    stage: Usd.Stage, rig: Rig, top: Usd.Prim, skeletons: Sequence[Usd.Prim]
) -> list[Finding]:
    """Return findings on what a scene has beside its rig."""
    kept = {str(top.GetPath()), *(mesh.path for mesh in rig.meshes), *paths_of_groups(stage)}
    return [
        *missing_metrics(stage),
        *report_unconverted(stage),
        *report_unconverted_parts(stage, rig.meshes),
        *report_unconverted_data(stage, kept),
        *report_unconverted_variants(stage),
        *report_unbound_skeletons(stage, skeletons),
        *report_empty_groups(stage, kept),
    ]


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


def _meshes_of(roots: Sequence[Usd.Prim]) -> list[Usd.Prim]:
    return list(dict.fromkeys(prim for root in roots for prim in placed_meshes(root)))


def _bindings(
    roots: list[Usd.Prim],
) -> tuple[dict[Sdf.Path, _Bound], list[Usd.Prim]]:
    cache = UsdSkel.Cache()
    bound: dict[Sdf.Path, _Bound] = {}
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
                bound[path] = _Bound(skeleton.GetPrim(), query, skinned)
    return bound, list(skeletons)


def staged_skeletons(stage: Usd.Stage) -> tuple[StagedSkeleton, ...]:
    """Return the skeletons that `rig_of_stage` joins, and the new names of their joints."""
    _, skeletons = _bindings(skel_roots(stage))
    xforms, si = UsdGeom.XformCache(_START), to_si(metrics_of(stage))
    given, _ = _read_skeletons(skeletons, xforms, si, joints=False, single=False)
    return join_skeletons(given)[1]


def skinned_by(stage: Usd.Stage) -> dict[str, Usd.Prim]:
    """Return the skeleton of each mesh that has a skin, by the mesh's path.

    Also one that the rig omits because it moves nothing: the transform of the mesh is ignored
    nevertheless.
    """
    bound, _ = _bindings(skel_roots(stage))
    return {str(path): binding.skeleton for path, binding in bound.items() if binding.skinned}


def skeleton_of_meshes(stage: Usd.Stage) -> dict[str, Sdf.Path]:
    """Return the skeleton that each mesh is bound to, by the mesh's path."""
    bound, _ = _bindings(skel_roots(stage))
    return {str(path): binding.skeleton.GetPath() for path, binding in bound.items()}


def spaces_of_meshes(stage: Usd.Stage) -> dict[str, FloatArray]:
    """Return the transform (4, 4) from the points of each mesh to rig space, by its path."""
    roots = skel_roots(stage)
    bound, _ = _bindings(roots)
    si, xforms = to_si(metrics_of(stage)), UsdGeom.XformCache(_START)
    return {
        str(prim.GetPath()): _bind_space(prim, bound.get(prim.GetPath()), xforms) @ si
        for prim in (*_meshes_of(roots), *outside_meshes(stage))
    }


def _read_skeletons(
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


def _bind_space(prim: Usd.Prim, bound: _Bound | None, xforms: UsdGeom.XformCache) -> FloatArray:
    if bound is None or not bound.skinned:
        return _world(prim, xforms)
    skeleton = _world(bound.skeleton, xforms)
    return _matrix(bound.query.GetGeomBindTransform(_START)) @ skeleton
