"""Triangle meshes of glTF under the transforms of their nodes."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from usdface.arrays import FloatArray
from usdface.geometry.vertex_normals import unit_or_zero
from usdface.rigs import CornerValues, Mesh

__all__ = ["TANGENTS", "bake_transform"]

TANGENTS = "tangents"


def bake_transform(mesh: Mesh, matrix: FloatArray) -> Mesh:
    """Return the mesh with a row-vector transform (4, 4) baked into points, offsets, normals.

    Where the transform mirrors, faces are turned around; where it flattens, the normals
    are left out. Normal offsets are scaled with the normals that they belong to.
    """
    if (matrix == np.eye(4)).all():
        return mesh
    linear = matrix[:3, :3]
    determinant = np.linalg.det(linear)
    normals, shapes = mesh.normals if determinant else None, list(mesh.shapes)
    turning: FloatArray = np.eye(3)
    lengths: FloatArray = np.ones(len(mesh.points))
    if normals is not None:
        turning = np.linalg.inv(linear).T.astype(np.float64)
        normals = normals @ turning
        lengths = np.sqrt((normals**2).sum(axis=1))
        lengths[lengths == 0] = 1.0
        normals = normals / lengths[:, None]
    for place, shape in enumerate(shapes):
        turned = shape.normal_offsets
        if turned is not None:
            scale = lengths[shape.indices, None]
            turned = None if normals is None else turned @ turning / scale
        shapes[place] = replace(shape, offsets=shape.offsets @ linear, normal_offsets=turned)
    points = mesh.points @ linear + matrix[3, :3]
    result = replace(mesh, points=points, normals=normals, shapes=tuple(shapes))
    tangents = mesh.corners(TANGENTS)
    if tangents is not None:
        sign = -1.0 if determinant < 0 else 1.0
        turned = np.concatenate([unit_or_zero(tangents[:, :3] @ linear), tangents[:, 3:] * sign], 1)
        others = (c for c in mesh.corner_values if c.name != TANGENTS)
        result = replace(result, corner_values=(*others, CornerValues(TANGENTS, turned)))
    return _reverse_winding(result) if determinant < 0 else result


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
