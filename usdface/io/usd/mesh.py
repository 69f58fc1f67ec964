"""One mesh of a USD stage as arrays in rig space."""

import numpy as np
from pxr import Usd, UsdGeom, UsdShade

from usdface.arrays import FloatArray, IntArray
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.geometry.vertex_normals import unit_or_up
from usdface.io.usd.attributes import changes
from usdface.io.usd.blend_shapes import read_shapes
from usdface.io.usd.conversion_metadata import CONTENT_NAME, read_metadata
from usdface.io.usd.extras import read_extras
from usdface.io.usd.face_varying_primvars import read_face_varying, to_face_varying
from usdface.io.usd.vertex_cache import points_move
from usdface.rigs import CORNER_NORMALS, CornerValues, MaterialSubset, Mesh, Skin

__all__ = ["bound_material", "read_mesh"]

_START = Usd.TimeCode.EarliestTime()
_KEPT_PRIMVARS = {"normals"}
_SKIN = "skel:"  # primvars of UsdSkel
_READ_ONCE = ("normals", "faceVertexCounts", "faceVertexIndices")
# Corner normals further than this from their mean are a hard edge: about 0.6 degrees.
_HARD_EDGE = 0.01


def read_mesh(
    mesh: UsdGeom.Mesh, space: FloatArray, skin: Skin | None
) -> tuple[Mesh | None, list[Finding]]:
    """Return a mesh with its shapes; None (with a finding) if it has no points.

    Parameters
    ----------
    mesh : UsdGeom.Mesh
    space : (4, 4) float64
        From the mesh's points to rig space (row vectors).
    skin : Skin or None
        Its influences, read already.

    Returns
    -------
    Mesh or None, list of Finding
        Its `material` and its subsets' are prim paths of materials, "" for none.

    Raises
    ------
    InputError
        If the faces or points make no sense.
    """
    prim = mesh.GetPrim()
    path = str(prim.GetPath())
    points = np.asarray(mesh.GetPointsAttr().Get(_START) or np.zeros((0, 3)), np.float64)
    if not len(points):
        return None, [
            finding("FEATURE_DROPPED", path, "a mesh without points is left out", feature="mesh")
        ]
    linear = space[:3, :3]
    determinant = float(np.linalg.det(linear))
    _check_space(path, points, determinant)
    turn = np.linalg.inv(linear).T * np.cbrt(abs(determinant))
    counts, indices = _faces(mesh, len(points))
    normals, hard, findings = _normals(mesh, counts, indices, len(points))
    turned = None if normals is None else normals @ turn
    uv_name, uvs, others, read, new_findings = read_face_varying(
        mesh, counts, indices, len(points), linear
    )
    findings += new_findings
    if hard is not None:
        others = (*others, CornerValues(CORNER_NORMALS, unit_or_up(hard @ turn)))
    left = mesh.GetOrientationAttr().Get() == UsdGeom.Tokens.leftHanded
    if left != (determinant < 0):
        order = _reversed_winding(counts)
        indices, uvs = indices[order], None if uvs is None else uvs[order]
        others = tuple(CornerValues(c.name, c.values[order]) for c in others)
    shapes, new_findings = read_shapes(prim, linear, turn, _lengths(turned, len(points)))
    findings += new_findings
    subsets, new_findings = _material_subsets(prim, len(counts))
    findings += new_findings
    findings += _dropped_features(mesh, read)
    extras, new_findings = read_extras(prim)
    findings += new_findings
    result = Mesh(
        name=prim.GetDisplayName() or prim.GetName(),
        points=points @ linear + space[3, :3],
        face_counts=counts,
        face_indices=indices,
        normals=None if turned is None else unit_or_up(turned),
        uvs=uvs,
        shapes=shapes,
        skin=skin,
        material=bound_material(prim),
        subsets=subsets,
        path=path,
        uv_name=uv_name,
        corner_values=others,
        extras=extras,
        flat=normals is None and mesh.GetSubdivisionSchemeAttr().Get() == UsdGeom.Tokens.none,
        content_name=str(read_metadata(prim).get(CONTENT_NAME, "")),
    )
    if result.flat:
        findings.append(finding("NORMALS_FLAT", path))
    return result, findings


def _check_space(path: str, points: FloatArray, determinant: float) -> None:
    """Refuse points that are no numbers, and a transform that flattens them."""
    if not np.isfinite(points).all():
        raise InputError(f"{path}: points must be finite numbers", "VALUES_WRONG")
    if not np.isfinite(determinant) or determinant == 0:
        raise InputError(
            f"{path}: the transform of the mesh flattens it; give it a scale", "VALUES_WRONG"
        )


def _lengths(normals: FloatArray | None, count: int) -> FloatArray:
    """Return the lengths (count,) of normals, 1 where there are none; offsets shrink with them."""
    lengths = np.ones(count) if normals is None else np.linalg.norm(normals, axis=1)
    return np.where(lengths > 0, lengths, 1.0)


def _faces(mesh: UsdGeom.Mesh, count: int) -> tuple[IntArray, IntArray]:
    counts = np.asarray(mesh.GetFaceVertexCountsAttr().Get(_START) or [], np.int64)
    indices = np.asarray(mesh.GetFaceVertexIndicesAttr().Get(_START) or [], np.int64)
    if (counts < 0).any() or counts.sum() != len(indices):
        raise InputError(
            f"{mesh.GetPath()}: faceVertexCounts add up to {counts.sum()}, "
            f"but there are {len(indices)} faceVertexIndices",
            "SCHEMA_BROKEN",
        )
    if len(indices) and not 0 <= indices.min() <= indices.max() < count:
        raise InputError(
            f"{mesh.GetPath()}: a faceVertexIndex is outside 0 to {count - 1}", "SCHEMA_BROKEN"
        )
    return counts, indices


def _reversed_winding(counts: IntArray) -> IntArray:
    """Return the order (C,) that walks each face the other way round, from its first corner."""
    starts = np.repeat(np.cumsum(counts) - counts, counts)
    local = np.arange(len(starts)) - starts
    size = np.repeat(counts, counts)
    order: IntArray = starts + (size - local) % size
    return order


def _normals(
    mesh: UsdGeom.Mesh, counts: IntArray, indices: IntArray, count: int
) -> tuple[FloatArray | None, FloatArray | None, list[Finding]]:
    """Return normals (V, 3) in the mesh's space, averaged; and those of hard edges (C, 3)."""
    path = str(mesh.GetPath())
    primvar = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("normals")
    if primvar and primvar.HasAuthoredValue():
        given, interpolation = primvar.ComputeFlattened(_START), primvar.GetInterpolation()
    else:
        given, interpolation = mesh.GetNormalsAttr().Get(_START), mesh.GetNormalsInterpolation()
    if not given:
        return None, None, []
    values = np.asarray(given, np.float64)
    corners = to_face_varying(values, interpolation, counts, indices, count)
    if corners is None or not np.isfinite(values).all():
        message = "{value_count} {interpolation} normals do not fit the mesh; they are left out"
        return (
            None,
            None,
            [
                finding(
                    "FEATURE_DROPPED", path, message, len(values), interpolation, feature="normals"
                )
            ],
        )
    if len(values) == count and interpolation in ("vertex", "varying"):
        return values, None, []
    total = [np.bincount(indices, corners[:, axis], count) for axis in range(3)]
    normals = unit_or_up(np.stack(total, axis=1))
    hard = (np.abs(unit_or_up(corners) - normals[indices]) > _HARD_EDGE).any()
    return normals, corners if hard else None, []


def bound_material(prim: Usd.Prim) -> str:
    """Return the path of the material that a prim shows; "" for none.

    That for previews, as viewers show it, or else for all purposes, or else for final renders.
    """
    binding = UsdShade.MaterialBindingAPI(prim)
    for purpose in (UsdShade.Tokens.preview, UsdShade.Tokens.full):
        if bound := binding.ComputeBoundMaterial(purpose)[0]:
            return str(bound.GetPath())
    return ""


def _material_subsets(
    prim: Usd.Prim, count: int
) -> tuple[tuple[MaterialSubset, ...], list[Finding]]:
    subsets: list[MaterialSubset] = []
    findings: list[Finding] = []
    whole = bound_material(prim)
    for subset in UsdShade.MaterialBindingAPI(prim).GetMaterialBindSubsets():
        faces = np.asarray(subset.GetIndicesAttr().Get(_START) or [], np.int64)
        inside = (faces >= 0) & (faces < count)
        if not inside.all():
            message = "faces outside 0 to {last_face} are left out"
            findings.append(
                finding(
                    "FEATURE_DROPPED", str(subset.GetPath()), message, count - 1, feature="faces"
                )
            )
        if changes(subset.GetIndicesAttr()):
            message = "its faces change over time, and stay as at the first"
            findings.append(finding("ANIMATION_DROPPED", str(subset.GetPath()), message))
        material = bound_material(subset.GetPrim())
        if material != whole:  # else it repeats that of the mesh
            subsets.append(MaterialSubset(material, faces[inside]))
    return tuple(subsets), findings


def _dropped_features(mesh: UsdGeom.Mesh, read: set[str]) -> list[Finding]:
    path = str(mesh.GetPath())
    scheme = mesh.GetSubdivisionSchemeAttr()
    kept = _KEPT_PRIMVARS | read
    primvars = {
        str(primvar.GetPrimvarName()): primvar.GetAttr()
        for primvar in UsdGeom.PrimvarsAPI(mesh).GetPrimvarsWithAuthoredValues()
    }
    others = [name for name in primvars if name not in kept and not name.startswith(_SKIN)]
    once = {name: mesh.GetPrim().GetAttribute(name) for name in _READ_ONCE}
    once |= {name: primvars[name] for name in primvars if name not in others}
    moving = sorted(name for name, attribute in once.items() if changes(attribute))
    findings = []
    # Points that move have normals that do; a vertex cache gets those of its shapes.
    if moving and not (moving == ["normals"] and points_move(mesh)):
        message = "they change over time, and stay as at the first: {channels}"
        findings.append(finding("ANIMATION_DROPPED", path, message, moving))
    if others:
        message = "primvars that usdface does not keep: {channels}"
        findings.append(finding("CHANNEL_IGNORED", path, message, sorted(others)))
    if scheme.HasAuthoredValue() and scheme.Get() != UsdGeom.Tokens.none:
        message = "subdivision scheme {scheme} is not kept; the cage is"
        findings.append(
            finding("FEATURE_DROPPED", path, message, str(scheme.Get()), feature="subdivision")
        )
    if mesh.GetHoleIndicesAttr().Get(_START):
        message = "holes are not kept; their faces are shown"
        findings.append(finding("FEATURE_DROPPED", path, message, feature="holes"))
    return findings
