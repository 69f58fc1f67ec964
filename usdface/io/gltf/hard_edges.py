"""Hard edges of a mesh: its points are split, as a glTF vertex has one normal.

Source: glTF 2.0 specification, section 3.7.2.1 (one NORMAL for each vertex).
"""

from dataclasses import replace

import numpy as np

from usdface.blend_shapes.blend_shape import BlendShape
from usdface.geometry.vertex_normals import unit_or_up
from usdface.io.gltf.vertex_split import split_vertices
from usdface.numerics.matching_rows import matching_rows
from usdface.rigs import CORNER_NORMALS, Mesh, Skin

__all__ = ["split_hard_edges"]

_STEPS = 1024  # of a normal's component: closer ones are one, which turns by 0.06 degrees at most


def split_hard_edges(mesh: Mesh) -> Mesh:
    """Return a mesh whose vertex normals are those of its face corners; itself where it has none.

    A point with corners of several normals becomes several points, which all shapes and joints move
    alike. Their normal offsets are left out: USD does not turn normals of corners, so that they are
    computed of the faces that meet in each of the new points.
    """
    given = mesh.corners(CORNER_NORMALS)
    if given is None:
        return mesh
    normals = unit_or_up(given)
    corners = np.arange(len(mesh.face_indices))
    split = split_vertices(mesh, corners, [np.round(normals * _STEPS)])
    total = [np.bincount(split.vertex, normals[:, axis], len(split.source)) for axis in range(3)]
    skin = mesh.skin
    return replace(
        mesh,
        points=mesh.points[split.source],
        face_indices=split.vertex,
        normals=unit_or_up(np.stack(total, 1)),
        shapes=tuple(_spread(shape, split.source) for shape in mesh.shapes),
        skin=None if skin is None else Skin(skin.joints[split.source], skin.weights[split.source]),
        corner_values=tuple(c for c in mesh.corner_values if c.name != CORNER_NORMALS),
    )


def _spread(shape: BlendShape, source: np.ndarray) -> BlendShape:
    """Return a shape of points as one of the vertices, each of point `source` (N,)."""
    if not len(shape.indices):
        return shape
    moved, rows = matching_rows(shape.indices, source)
    between = tuple(
        replace(step, offsets=step.offsets[rows], normal_offsets=None) for step in shape.inbetweens
    )
    return replace(
        shape,
        indices=moved,
        offsets=shape.offsets[rows],
        normal_offsets=None,
        inbetweens=between,
    )
