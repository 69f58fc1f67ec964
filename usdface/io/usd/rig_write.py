"""Writing a rig as UsdSkel, for usdview, Blender, Maya and AR viewers."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from pxr import Gf, Kind, Tf, Usd, UsdGeom, UsdShade, UsdSkel, Vt

from usdface.clips import Clip
from usdface.errors import InputError, OutputError
from usdface.findings import Finding, finding
from usdface.geometry.vertex_normals import normals_of_faces, unit_or_up
from usdface.io.atomic import all_or_none
from usdface.io.prim_names import prim_names
from usdface.io.usd.clips_write import clock_of, time_codes, write_clips
from usdface.io.usd.conversion_metadata import CONTENT_NAME, SKIN_NAME, write_metadata
from usdface.io.usd.errors import usd_message
from usdface.io.usd.extras import write_asset, write_extras
from usdface.io.usd.face_varying_primvars import write_face_varying
from usdface.io.usd.groups import write_groups
from usdface.io.usd.joint_frames import with_unit_scales
from usdface.io.usd.material_variants import write_material_variants
from usdface.io.usd.materials_write import write_materials
from usdface.io.usd.metrics import Metrics, new_stage
from usdface.io.usd.rig_bounds import posed_bounds
from usdface.io.usd.save_layers import save_layer
from usdface.io.usd.scene import write_scene
from usdface.io.usd.shapes_write import write_shapes
from usdface.io.usd.value_arrays import matrices, vec3f_array
from usdface.rigs import CORNER_NORMALS, MaterialSubset, Mesh, Rig, Skeleton, Skin

__all__ = ["write_rig"]

_FACE = "/Asset/Face"
_SUFFIXES = (".usd", ".usda", ".usdc")
# Without any joint Hydra 2 and some AR viewers lose shape-only skeletons (OpenUSD#3873, #2425).
_DUMMY = Skeleton(("root",), ("root",), np.eye(4)[None], np.eye(4)[None])


def write_rig(
    rig: Rig, path: Path, clips: Sequence[Clip] = (), read: Iterable[Path] = ()
) -> list[Finding]:
    """Write `rig` as UsdSkel, in metres, Y up, with its clips.

    Layout: `/Asset` (default prim) holds the SkelRoot `Face` with `Skel`, `Anim` and the
    meshes, and `Materials`, `Cameras`, `Lights`; several clips lie in the scope `Animations`,
    and the variant set `animation` of the SkelRoot chooses one (`usdface.io.usd.clips_write`).
    The tokens of `skel:blendShapes` are the original names; prim names are their legal, unique
    forms. A rig without a skeleton gets one joint that does nothing. Normals and normal offsets
    that the rig lacks are computed.

    Parameters
    ----------
    rig : Rig
    path : Path
        `.usda` text, `.usdc` or `.usd` binary; replaced only when all is written.
    clips : sequence of Clip
        Time code = time * rate, and the stage's timeCodesPerSecond is the highest of their rates.
    read : iterable of Path
        Files that textures beside the stage must not replace; those of the rig's own never are.

    Raises
    ------
    OutputError
        If the file or a texture cannot be written, or the suffix is not USD's.
    InputError
        If the rig has no meshes, or a skin does not fit its mesh and skeleton.

    References
    ----------
    OpenUSD, UsdSkel schemas (Skeleton, SkelAnimation, BlendShape); observed behaviour of
    usdview, Blender and maya-usd for the attributes they need.
    """
    if path.suffix.lower() not in _SUFFIXES:
        raise OutputError(f"{path} is not a USD file name; use {', '.join(_SUFFIXES)}")
    if not rig.meshes:
        raise InputError(f"the rig {rig.source or rig.name!r} has no meshes to write")
    with all_or_none():  # textures and layer
        try:
            stage, findings = _stage_of(rig, path, clips, read)
        except Tf.ErrorException as error:
            raise OutputError(f"cannot write {path}: {usd_message(error)}") from error
        save_layer(stage.GetRootLayer(), path)
    return findings


def _stage_of(
    rig: Rig, path: Path, clips: Sequence[Clip], read: Iterable[Path]
) -> tuple[Usd.Stage, list[Finding]]:
    skeleton, clips, findings = with_unit_scales(rig.skeleton or _DUMMY, clips)
    rig = replace(rig, skeleton=skeleton if rig.skeleton else None)
    rate = clock_of(clips)
    codes = time_codes(np.unique(np.concatenate([np.zeros(1), *(c.times for c in clips)])), rate)
    stage = new_stage(Metrics(1.0, "Y", rate, rate, float(codes[0]), float(codes[-1])), "Asset")
    asset = stage.GetDefaultPrim()
    Usd.ModelAPI(asset).SetKind(Kind.Tokens.component)
    if rig.name and rig.name != asset.GetName():
        asset.SetDisplayName(rig.name)
    findings += write_extras(asset, rig.extras) + write_asset(asset, rig.asset)
    findings += write_scene(stage, rig.cameras, rig.lights)
    findings += write_groups(stage, rig)
    if rig.materials:
        materials, new_findings = write_materials(stage, _scope(stage), rig.materials, path, read)
        findings += new_findings
    else:
        materials = {}
    named = dict.fromkeys(name for clip in clips if clip.weights for name in clip.weights.names)
    findings += [
        finding("SHAPE_UNKNOWN", name, "the weights name a blend shape that the rig lacks")
        for name in named
        if name not in rig.shape_names
    ]
    root = UsdSkel.Root.Define(stage, _FACE)
    write_clips(root, _write_skeleton(stage, skeleton), skeleton, rig.shape_names, clips, rate)
    names = prim_names((mesh.name for mesh in rig.meshes), ("Skel", "Anim", "Animations"))
    sided = {m.name for m in rig.materials if m.double_sided}
    for name, mesh in zip(names, rig.meshes, strict=True):
        findings += _write_mesh(stage, f"{_FACE}/{name}", mesh, rig, materials, sided)
    write_material_variants(
        stage, {f"{_FACE}/{n}": m for n, m in zip(names, rig.meshes, strict=True)}, materials
    )
    bounds = np.array([posed_bounds(mesh, rig.skeleton, clips) for mesh in rig.meshes])
    root.CreateExtentAttr(vec3f_array([bounds[:, 0].min(axis=0), bounds[:, 1].max(axis=0)]))
    return stage, findings


def _scope(stage: Usd.Stage) -> str:
    return str(UsdGeom.Scope.Define(stage, "/Asset/Materials").GetPath())


def _write_skeleton(stage: Usd.Stage, skeleton: Skeleton) -> UsdSkel.Skeleton:
    skel = UsdSkel.Skeleton.Define(stage, f"{_FACE}/Skel")
    skel.CreateJointsAttr(skeleton.joints)
    skel.CreateJointNamesAttr(skeleton.names)
    skel.CreateBindTransformsAttr(matrices(skeleton.bind))
    skel.CreateRestTransformsAttr(matrices(skeleton.rest))
    if skeleton.skin_name:
        write_metadata(skel.GetPrim(), SKIN_NAME, skeleton.skin_name)
    return skel


def _write_mesh(
    stage: Usd.Stage,
    path: str,
    mesh: Mesh,
    rig: Rig,
    materials: dict[str, UsdShade.Material],
    double_sided: set[str],
) -> list[Finding]:
    prim = UsdGeom.Mesh.Define(stage, path)
    points = vec3f_array(mesh.points)
    prim.CreatePointsAttr(points)
    prim.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(mesh.face_counts.astype(np.int32)))
    prim.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(mesh.face_indices.astype(np.int32)))
    prim.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    prim.CreateOrientationAttr(UsdGeom.Tokens.rightHanded)
    prim.CreateExtentAttr(UsdGeom.PointBased.ComputeExtent(points))
    findings = _write_normals(prim, mesh)
    write_face_varying(prim, mesh)
    if prim.GetPrim().GetName() != mesh.name:
        prim.GetPrim().SetDisplayName(mesh.name)
        findings.append(finding("NAME_CHANGED", path, "was {original!r}", mesh.name))
    findings += write_extras(prim.GetPrim(), mesh.extras)
    for key, text in (("group", mesh.group), (CONTENT_NAME, mesh.content_name)):
        if text:
            write_metadata(prim.GetPrim(), key, text)
    _bind_skin(prim, mesh, rig)
    shape_prims = prim_names(mesh.shape_names)
    findings += write_shapes(prim, mesh, shape_prims)
    findings += _bind_materials(prim, mesh, materials, shape_prims)
    findings += _write_sides(prim, mesh, materials, double_sided)
    return findings


def _write_sides(
    prim: UsdGeom.Mesh, mesh: Mesh, materials: dict[str, UsdShade.Material], double_sided: set[str]
) -> list[Finding]:
    """Show both sides of a mesh if one of its materials does: USD knows it of meshes alone."""
    bound = set(mesh.materials)
    if not double_sided & bound:
        return []
    prim.CreateDoubleSidedAttr(True)
    single = sorted(name for name in bound - double_sided if name in materials)
    if not single:
        return []
    for name in single:
        write_metadata(materials[name].GetPrim(), "singleSided", True)
    message = "both sides are shown also of {materials}: USD knows no sides of materials"
    return [
        finding(
            "FEATURE_APPROXIMATED", str(prim.GetPath()), message, single, feature="material_sides"
        )
    ]


def _write_normals(prim: UsdGeom.Mesh, mesh: Mesh) -> list[Finding]:
    if mesh.flat:
        return [finding("NORMALS_FLAT", str(prim.GetPath()))]
    hard = mesh.corners(CORNER_NORMALS)
    if hard is not None:
        prim.CreateNormalsAttr(vec3f_array(hard))
        prim.SetNormalsInterpolation(UsdGeom.Tokens.faceVarying)
        return []
    computed = mesh.normals is None
    if mesh.normals is None:
        faces = normals_of_faces(mesh.face_counts, mesh.face_indices, len(mesh.points))
        normals = faces(mesh.points)
    else:
        normals = unit_or_up(mesh.normals)
    prim.CreateNormalsAttr(vec3f_array(normals))
    prim.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
    return [finding("NORMALS_COMPUTED", str(prim.GetPath()))] if computed else []


def _bind_skin(prim: UsdGeom.Mesh, mesh: Mesh, rig: Rig) -> None:
    binding = UsdSkel.BindingAPI.Apply(prim.GetPrim())
    skin, count = mesh.skin, len(mesh.points)
    if skin is None and rig.skeleton is not None:
        return  # no joint of a real skeleton may move an unskinned mesh
    if skin is None:
        skin = Skin(np.zeros((count, 1), np.int64), np.ones((count, 1)))
    joints = len((rig.skeleton or _DUMMY).joints)
    fits = skin.joints.shape == skin.weights.shape and skin.joints.shape[:1] == (count,)
    if not fits or (skin.joints.size and not 0 <= skin.joints.min() <= skin.joints.max() < joints):
        raise InputError(
            f"mesh {mesh.name!r}: the skin has joints of shape {skin.joints.shape} and weights of "
            f"shape {skin.weights.shape} for {count} points and {joints} joints"
        )
    width = skin.joints.shape[1]
    binding.CreateJointIndicesPrimvar(False, width).Set(
        Vt.IntArray.FromNumpy(skin.joints.astype(np.int32).ravel())
    )
    binding.CreateJointWeightsPrimvar(False, width).Set(
        Vt.FloatArray.FromNumpy(skin.weights.astype(np.float32).ravel())
    )
    binding.CreateGeomBindTransformAttr(Gf.Matrix4d(1.0))


def _bind_materials(
    prim: UsdGeom.Mesh,
    mesh: Mesh,
    materials: dict[str, UsdShade.Material],
    taken: tuple[str, ...],
) -> list[Finding]:
    path = str(prim.GetPath())
    findings: list[Finding] = []

    def bind(target: Usd.Prim, name: str) -> None:
        if name in materials:
            UsdShade.MaterialBindingAPI.Apply(target).Bind(materials[name])
        elif name:
            message = "the rig has no material {material!r}; the binding is left out"
            findings.append(finding("FEATURE_DROPPED", path, message, name, feature="material"))

    binding = UsdShade.MaterialBindingAPI.Apply(prim.GetPrim())
    bind(prim.GetPrim(), mesh.material)
    if not mesh.subsets:
        return findings
    subsets = mesh.subsets
    rest = np.setdiff1d(
        np.arange(len(mesh.face_counts)), np.concatenate([s.faces for s in subsets])
    )
    if len(rest) and mesh.material:
        # Blender leaves faces without a material where some are in subsets and others are not.
        subsets = (*subsets, MaterialSubset(mesh.material, rest))
    names = prim_names((s.material or "unassigned" for s in subsets), taken)
    for name, subset in zip(names, subsets, strict=True):
        faces = Vt.IntArray.FromNumpy(subset.faces.astype(np.int32))
        made = binding.CreateMaterialBindSubset(name, faces)
        bind(made.GetPrim(), subset.material)
    return findings
