"""Primvars at the face corners of a mesh: texture coordinates, vertex colours, tangents."""

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf, Usd, UsdGeom, Vt

from usdface.arrays import FloatArray, IntArray
from usdface.findings import Finding, finding
from usdface.geometry.vertex_normals import unit_or_up
from usdface.io.usd.value_arrays import vec2f_array, vec3f_array
from usdface.rigs import CornerValues, Mesh

__all__ = ["read_face_varying", "to_face_varying", "write_face_varying"]

_START = Usd.TimeCode.EarliestTime()
_UV = "VtArray<GfVec2f>"


def to_face_varying(
    values: NDArray[np.float64], interpolation: str, counts: IntArray, indices: IntArray, count: int
) -> NDArray[np.float64] | None:
    """Return a primvar's values (N, K) at the face corners (C, K).

    None where their number does not fit `interpolation` on a mesh of `count` points.
    """
    if interpolation in ("vertex", "varying") and len(values) == count:
        return values[indices]
    if interpolation == "faceVarying" and len(values) == len(indices):
        return values
    if interpolation == "uniform" and len(values) == len(counts):
        return np.repeat(values, counts, axis=0)
    if interpolation == "constant" and len(values) == 1:
        return np.repeat(values, len(indices), axis=0)
    return None


def read_face_varying(
    mesh: UsdGeom.Mesh, counts: IntArray, indices: IntArray, count: int, linear: FloatArray
) -> tuple[str, FloatArray | None, tuple[CornerValues, ...], list[Finding]]:
    """Return the face-varying data of a mesh, for its face corners (C).

    Returns
    -------
    name, uvs : str, (C, 2) float64 or None
        `st`, or else the first texture coordinates (Blender 4 names them UVMap).
    others : tuple of CornerValues
        Further texture coordinates; ``displayColor`` with its opacity as a fourth column;
        ``tangents``, turned by `linear` (3, 3).
    list of Finding
    """
    found: list[Finding] = []
    primvars = {p.GetPrimvarName(): p for p in UsdGeom.PrimvarsAPI(mesh).GetPrimvarsWithValues()}

    def values(name: str, width: int) -> FloatArray | None:
        given = primvars[name].ComputeFlattened(_START) if name in primvars else None
        if not given:
            return None
        array = np.asarray(given, np.float64).reshape(len(given), -1)
        fitting = to_face_varying(array, primvars[name].GetInterpolation(), counts, indices, count)
        if fitting is None or array.shape[1] != width or not np.isfinite(array).all():
            message = "{value_count} values of {attribute} do not fit the mesh; they are left out"
            found.append(
                finding(
                    "FEATURE_DROPPED",
                    str(mesh.GetPath()),
                    message,
                    len(array),
                    name,
                    feature="primvar",
                )
            )
            return None
        return fitting

    sets = sorted(name for name, p in primvars.items() if p.GetTypeName().cppTypeName == _UV)
    sets.sort(key=lambda name: name != "st")
    coordinates = {name: uvs for name in sets if (uvs := values(name, 2)) is not None}
    first = next(iter(coordinates), "st")
    others = [CornerValues(name, uvs) for name, uvs in coordinates.items() if name != first]
    colours, opacity = values("displayColor", 3), values("displayOpacity", 1)
    if colours is not None or opacity is not None:
        shown = np.ones((len(indices), 3)) if colours is None else colours
        columns = [shown] if opacity is None else [shown, opacity]
        others.append(CornerValues("displayColor", np.concatenate(columns, 1)))
    tangents = values("tangents", 4)
    if tangents is not None:
        sign = np.where(np.linalg.det(linear) < 0, -1.0, 1.0)
        turned = np.concatenate([unit_or_up(tangents[:, :3] @ linear), tangents[:, 3:] * sign], 1)
        others.append(CornerValues("tangents", turned))
    return first, coordinates.get(first), tuple(others), found


def write_face_varying(prim: UsdGeom.Mesh, mesh: Mesh) -> None:
    """Author face-varying data as primvars, per point where all its corners agree."""
    api = UsdGeom.PrimvarsAPI(prim)
    names = Sdf.ValueTypeNames

    def author(name: str, kind: Sdf.ValueTypeName, values: object, interpolation: str) -> None:
        api.CreatePrimvar(name, kind, interpolation).Set(values)

    for name, uvs in mesh.uv_sets.items():
        author(name, names.TexCoord2fArray, vec2f_array(uvs), UsdGeom.Tokens.faceVarying)
    colours, tangents = mesh.corners("displayColor"), mesh.corners("tangents")
    if colours is not None:
        shown, kind = _smallest_interpolation(mesh, colours)
        author("displayColor", names.Color3fArray, vec3f_array(shown[:, :3]), kind)
        if shown.shape[1] == 4:
            opacity = Vt.FloatArray.FromNumpy(shown[:, 3].astype(np.float32))
            author("displayOpacity", names.FloatArray, opacity, kind)
    if tangents is not None:
        shown, kind = _smallest_interpolation(mesh, tangents)
        array = Vt.Vec4fArray.FromNumpy(np.ascontiguousarray(shown, np.float32))
        author("tangents", names.Float4Array, array, kind)


def _smallest_interpolation(mesh: Mesh, values: FloatArray) -> tuple[FloatArray, str]:
    """Return values (C, K) with the interpolation that needs fewest of them."""
    if len(values) and (values == values[0]).all():
        return values[:1], UsdGeom.Tokens.constant
    per_point = np.zeros((len(mesh.points), values.shape[1]))
    per_point[mesh.face_indices] = values
    if (per_point[mesh.face_indices] == values).all():
        return per_point, UsdGeom.Tokens.vertex
    return values, UsdGeom.Tokens.faceVarying
