"""Meshes under a transform, their blend shapes, normals and tangents with them."""

from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from usdface.arrays import FloatArray
from usdface.blend_shapes.blend_shape import BlendShape, Inbetween
from usdface.geometry.vertex_normals import unit_or_zero
from usdface.rigs import CornerValues, Mesh

__all__ = ["TANGENTS", "bake_transform"]

TANGENTS = "tangents"
_Shape = TypeVar("_Shape", BlendShape, Inbetween)


def bake_transform(mesh: Mesh, matrix: FloatArray) -> Mesh:
    """Return the mesh with a row-vector transform (4, 4) baked into points, offsets, normals.

    Where the transform mirrors, faces, which must be triangles, are turned around; where it
    flattens, the normals are left out. Normal offsets are scaled with the normals that they
    belong to.
    """
    if (matrix == np.eye(4)).all():
        return mesh
    linear = matrix[:3, :3]
    determinant = np.linalg.det(linear)
    normals, turning = mesh.normals if determinant else None, None
    lengths: FloatArray = np.ones(len(mesh.points))
    if normals is not None:
        turning = np.linalg.inv(linear).T.astype(np.float64)
        normals = normals @ turning
        lengths = np.sqrt((normals**2).sum(axis=1))
        lengths[lengths == 0] = 1.0
        normals = normals / lengths[:, None]
    shapes = tuple(_baked_shape(shape, linear, turning, lengths) for shape in mesh.shapes)
    points = mesh.points @ linear + matrix[3, :3]
    result = replace(mesh, points=points, normals=normals, shapes=shapes)
    tangents = mesh.corners(TANGENTS)
    if tangents is not None:
        sign = -1.0 if determinant < 0 else 1.0
        turned = np.concatenate([unit_or_zero(tangents[:, :3] @ linear), tangents[:, 3:] * sign], 1)
        others = (c for c in mesh.corner_values if c.name != TANGENTS)
        result = replace(result, corner_values=(*others, CornerValues(TANGENTS, turned)))
    return _reverse_winding(result) if determinant < 0 else result


def _baked_shape(
    shape: BlendShape, linear: FloatArray, turning: FloatArray | None, lengths: FloatArray
) -> BlendShape:
    """Return a blend shape under a linear map (3, 3), its inbetweens with it.

    Normals turn by `turning` (3, 3), None = the mesh has none, and get the `lengths` (V,).
    """

    def baked(each: _Shape) -> _Shape:
        turned = None
        if turning is not None and each.normal_offsets is not None:
            turned = each.normal_offsets @ turning / lengths[shape.indices, None]
        return replace(each, offsets=each.offsets @ linear, normal_offsets=turned)

    return replace(baked(shape), inbetweens=tuple(baked(each) for each in shape.inbetweens))


def _reverse_winding(mesh: Mesh) -> Mesh:
    """Return the mesh with its triangles walked the other way round."""

    def back(values: NDArray[Any]) -> NDArray[Any]:
        return values.reshape(-1, 3, *values.shape[1:])[:, ::-1].reshape(values.shape)

    return replace(
        mesh,
        face_indices=back(mesh.face_indices),
        uvs=None if mesh.uvs is None else back(mesh.uvs),
        corner_values=tuple(CornerValues(c.name, back(c.values)) for c in mesh.corner_values),
    )
