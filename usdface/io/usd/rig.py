"""Rigs from USD: any UsdSkel asset as meshes in metres, Y up, right-handed."""

from collections.abc import Collection
from dataclasses import replace
from pathlib import Path

import numpy as np
from pxr import Sdf, Usd, UsdGeom

from usdface.arrays import FloatArray
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.usd.errors import usd_errors
from usdface.io.usd.extras import prim_of_asset, read_asset, read_extras
from usdface.io.usd.groups import read_groups
from usdface.io.usd.material_variants import read_material_variants
from usdface.io.usd.materials import read_mesh_materials
from usdface.io.usd.mesh import read_mesh
from usdface.io.usd.metrics import metrics_of, missing_metrics, to_si
from usdface.io.usd.mixed_metrics import report_mixed_metrics
from usdface.io.usd.rendered_meshes import outside_meshes, rendered_meshes
from usdface.io.usd.scene import read_scene
from usdface.io.usd.skel_bindings import (
    bind_space,
    meshes_below,
    read_skeletons,
    skel_bindings,
    skel_roots,
)
from usdface.io.usd.skeleton import read_skin
from usdface.io.usd.skeletons import join_skeletons
from usdface.io.usd.splines import report_splines
from usdface.io.usd.stage import open_stage
from usdface.io.usd.unconverted_scene import report_unconverted_scene
from usdface.io.usd.vertex_cache import points_move
from usdface.rigs import Mesh, Rig, Skeleton, Skin

__all__ = ["read_rig", "rig_of_stage"]

_START = Usd.TimeCode.EarliestTime()


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
        findings += report_splines(stage)
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
    skeleton, meshes, findings = _skinned_meshes(stage, roots, root, joints, purposes, si)
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
    rig, lost = _with_scene(rig, stage, top, si)
    if referenced:
        return rig, findings
    lost += [*missing_metrics(stage), *report_unconverted_scene(stage, looks, top)]
    return rig, findings + lost


def _skinned_meshes(
    stage: Usd.Stage,
    roots: list[Usd.Prim],
    root: str,
    joints: bool,
    purposes: Collection[str],
    si: FloatArray,
) -> tuple[Skeleton | None, list[Mesh], list[Finding]]:
    """Read the meshes under `root`, or all of a scene, and the one skeleton that moves them."""
    bound, skeletons = skel_bindings(roots)
    xforms = UsdGeom.XformCache(_START)
    given, findings = read_skeletons(skeletons, xforms, si, joints, single=bool(root))
    skeleton, staged = join_skeletons(given)
    used = {one.path: one for one in staged}
    below = Sdf.Path(root) if root else Sdf.Path.absoluteRootPath
    meshes: list[Mesh] = []
    prims = [prim for prim in meshes_below(roots) if prim.GetPath().HasPrefix(below)]
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
        space = bind_space(prim, binding, xforms) @ si
        mesh, new_findings = read_mesh(UsdGeom.Mesh(prim), space, skin)
        findings += new_findings
        if mesh and mesh.shapes and prim in outside:
            mesh = replace(mesh, shapes=())
            findings.append(finding("MESH_OUTSIDE", mesh.path))
        meshes += [mesh] if mesh else []
    return skeleton, meshes, findings


def _with_scene(
    rig: Rig, stage: Usd.Stage, top: Usd.Prim, si: FloatArray
) -> tuple[Rig, list[Finding]]:
    """Return the rig with its surroundings: cameras, lights, groups, data of others."""
    cameras, lights, findings = read_scene(stage, si)
    extras, new_findings = read_extras(top)
    findings += new_findings
    asset, new_findings = read_asset(prim_of_asset(top, skel_roots(stage)))
    findings += new_findings
    groups, joint_extras, grouped, new_findings = read_groups(stage, si, rig.meshes)
    rig = replace(rig, cameras=cameras, lights=lights, extras=extras, asset=asset)
    rig = replace(rig, meshes=grouped, groups=groups, joint_extras=joint_extras)
    return rig, findings + new_findings
