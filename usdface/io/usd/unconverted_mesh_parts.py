"""Parts of meshes of a stage that `usdface.rigs.Mesh` has no place for."""

from collections.abc import Iterable

import numpy as np
from pxr import Usd, UsdGeom, UsdShade

from usdface.findings import Finding, finding
from usdface.io.usd.stage import stage_name
from usdface.rigs import Mesh

__all__ = ["report_pivots", "report_unconverted_parts"]

_START = Usd.TimeCode.EarliestTime()


def report_unconverted_parts(stage: Usd.Stage, meshes: Iterable[Mesh]) -> list[Finding]:
    """Return findings on creases, velocities, sets of faces, and sides of bare faces."""
    found = []
    for mesh in meshes:
        given = UsdGeom.Mesh(stage.GetPrimAtPath(mesh.path))
        if unread := [*_sharp_parts(given), *_blurs(given), *_other_subsets(given)]:
            message = "parts of the mesh that usdface does not keep: {channels}"
            found.append(finding("CHANNEL_IGNORED", mesh.path, message, unread))
        if _has_bare_faces(mesh) and given.GetDoubleSidedAttr().Get(_START):
            message = "it shows both sides, which only faces with a material keep"
            found.append(finding("FEATURE_DROPPED", mesh.path, message, feature="double_sided"))
    return found


def report_pivots(stage: Usd.Stage, meshes: Iterable[Mesh]) -> list[Finding]:
    """Return PIVOTS_DROPPED for meshes that stand by transforms, and not by a skin."""
    xforms = UsdGeom.XformCache(_START)
    unskinned = {m.path: stage.GetPrimAtPath(m.path) for m in meshes if m.skin is None}
    worlds = {p: np.array(xforms.GetLocalToWorldTransform(m)) for p, m in unskinned.items()}
    moved = [path for path, world in worlds.items() if not np.allclose(world, np.eye(4))]
    where = stage_name(stage)
    message = "transforms are applied to the points of {meshes}; their pivots are not kept"
    return [finding("PIVOTS_DROPPED", where, message, moved)] if moved else []


def _has_bare_faces(mesh: Mesh) -> bool:
    return not mesh.material and sum(len(s.faces) for s in mesh.subsets) < len(mesh.face_counts)


def _sharp_parts(mesh: UsdGeom.Mesh) -> list[str]:
    """Return the attributes of a mesh that sharpen a subdivided surface, where they do."""
    if mesh.GetSubdivisionSchemeAttr().Get() == UsdGeom.Tokens.none:
        return []
    sharp = {
        "creaseIndices": mesh.GetCreaseIndicesAttr(),
        "cornerIndices": mesh.GetCornerIndicesAttr(),
    }
    return [name for name, attribute in sharp.items() if attribute.Get(_START)]


def _blurs(mesh: UsdGeom.Mesh) -> list[str]:
    """Return the attributes that blur the points of a mesh that move, as caches have them."""
    return [
        name
        for name in ("velocities", "accelerations")
        if mesh.GetPrim().GetAttribute(name).Get(_START)
    ]


def _other_subsets(mesh: UsdGeom.Mesh) -> list[str]:
    """Return the names of a mesh's subsets that bind no material, as sets of faces to select."""
    of_materials = {
        subset.GetPath()
        for subset in UsdShade.MaterialBindingAPI(mesh.GetPrim()).GetMaterialBindSubsets()
    }
    subsets = UsdGeom.Subset.GetAllGeomSubsets(UsdGeom.Imageable(mesh))
    return [
        f"subset {each.GetPrim().GetName()}"
        for each in subsets
        if each.GetPath() not in of_materials
    ]
