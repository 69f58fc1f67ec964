"""Face-varying data as vertex attributes of glTF: vertices are split where corners differ.

Source: glTF 2.0 specification, section 3.7.2.1 (attributes), 3.7.2.2 (morph targets: TANGENT).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pygltflib
from pygltflib import ARRAY_BUFFER

from usdface.arrays import FloatArray, IntArray
from usdface.geometry.bake_transform import TANGENTS
from usdface.geometry.vertex_normals import unit_or_up
from usdface.io.gltf.buffer import BufferBuilder
from usdface.io.gltf.vertex_colours import COLOURS
from usdface.rigs import Mesh, Rig

__all__ = [
    "Split",
    "split_vertices",
    "tangent_deltas",
    "texcoord_count",
    "uv_order",
    "write_corner_attributes",
    "write_vertex_colours",
]


@dataclass(frozen=True, eq=False, slots=True)
class Split:
    """Vertices of glTF: one for each used combination of a point and its corner data.

    `source` (N,) is the point of each vertex, increasing; `vertex` (C,) the vertex of each
    face corner; `corner` (N,) a corner of each vertex.
    """

    source: IntArray
    vertex: IntArray
    corner: IntArray


def split_vertices(mesh: Mesh, corners: IntArray, held: Sequence[FloatArray]) -> Split:
    """Split the points of a mesh where values `held` (C, K) at its corners differ as float32."""
    used = np.unique(corners)
    key = mesh.face_indices[used].astype(np.int64)
    for place, values in enumerate(held):
        if place:  # ranks, so that the key of many attributes does not overflow
            _, key = np.unique(key, return_inverse=True)
        rows = np.ascontiguousarray(values[used].astype(np.float32) + np.float32(0))
        # Two numbers are one of 64 bits, which sorts faster.
        width = rows.itemsize * rows.shape[1]
        dtype = np.dtype(np.uint64) if width == 8 else np.dtype((np.void, width))
        kinds, kind = np.unique(rows.view(dtype)[:, 0], return_inverse=True)
        key = key * len(kinds) + kind
    point = mesh.face_indices[used]
    _, first, vertex = np.unique(key, return_index=True, return_inverse=True)
    of_corner = np.full(len(mesh.face_indices), -1)
    of_corner[used] = vertex
    return Split(point[first], of_corner, used[first])


def uv_order(rig: Rig) -> list[str]:
    """Return the names of texture coordinates in the order of TEXCOORD_0, TEXCOORD_1, ..."""
    names = dict.fromkeys(name for mesh in rig.meshes for name in mesh.uv_sets)
    return sorted(names, key=lambda name: name != "st")


def write_corner_attributes(
    mesh: Mesh,
    split: Split,
    order: Sequence[str],
    wanted: int,
    builder: BufferBuilder,
) -> dict[str, int]:
    """Append texture coordinates and tangents; return accessors by attribute.

    `wanted` is how many texture coordinates the materials read: one that the mesh lacks, or that
    stands before one it has, is zeros that take no bytes.
    """
    accessors = {}
    given = mesh.uv_sets
    count = max([wanted, *(order.index(name) + 1 for name in given)])
    for place in range(count):
        uvs = given.get(order[place]) if place < len(order) else None
        accessors[f"TEXCOORD_{place}"] = (
            builder.zeros(len(split.source), 2)
            if uvs is None
            else builder.array(uvs[split.corner] * (1, -1) + (0, 1), ARRAY_BUFFER, short="unsigned")
        )
    tangents = mesh.corners(TANGENTS)
    if tangents is not None:
        accessors["TANGENT"] = builder.array(
            _unit_tangents(tangents[split.corner]), ARRAY_BUFFER, short="signed"
        )
    return accessors


def write_vertex_colours(mesh: Mesh, split: Split, builder: BufferBuilder) -> int | None:
    """Append the vertex colours of a mesh; return the accessor, None where there are none."""
    colours = mesh.corners(COLOURS)
    if colours is None:
        return None
    return builder.array(colours[split.corner].clip(min=0), ARRAY_BUFFER, short="unsigned")


def _unit_tangents(tangents: FloatArray) -> FloatArray:
    sign = np.where(tangents[:, 3:] < 0, -1.0, 1.0)
    return np.concatenate([unit_or_up(tangents[:, :3]), sign], 1)


def tangent_deltas(
    tangents: FloatArray, split: Split, normals: FloatArray, turn: tuple[IntArray, FloatArray]
) -> tuple[IntArray, FloatArray]:
    """Return the vertices whose `tangents` (C, 4) a shape turns, and the changes (N, 3).

    A tangent stays in the plane across the normal, which the shape turns from `normals` (V, 3)
    by `turn` (points and their change).
    """
    change = np.zeros_like(normals)
    change[turn[0]] = turn[1]
    moved = np.flatnonzero(change[split.source].any(axis=1))
    still = _unit_tangents(tangents[split.corner[moved]])[:, :3]
    across = unit_or_up((normals + change)[split.source[moved]])
    turned = unit_or_up(still - across * (still * across).sum(axis=1, keepdims=True))
    return moved, turned - still


def texcoord_count(
    primitives: Sequence[pygltflib.Primitive], materials: Mapping[str, pygltflib.Material]
) -> int:
    """Return how many texture coordinates the materials of primitives read."""
    used = list(materials.values())
    most = 0
    for primitive in primitives:
        if primitive.material is not None:
            material = used[primitive.material]
            pbr = material.pbrMetallicRoughness
            slots = (pbr.baseColorTexture, pbr.metallicRoughnessTexture)
            own = ("normalTexture", "occlusionTexture", "emissiveTexture")
            for info in (*slots, *(getattr(material, slot) for slot in own)):
                if info is not None:
                    most = max(most, (info.texCoord or 0) + 1)
    return most
