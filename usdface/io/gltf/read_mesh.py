"""Meshes of glTF: primitives merged into one polygon mesh and welded."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pygltflib import TRIANGLE_FAN, TRIANGLE_STRIP, TRIANGLES, Primitive

from usdface.arrays import FloatArray, IntArray
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.geometry.bake_transform import TANGENTS
from usdface.geometry.vertex_normals import unit_or_zero
from usdface.io.gltf.accessors import AccessorReader
from usdface.io.gltf.primitives import (
    ReadRows,
    VertexBlock,
    material_of,
    refuse_unknown_compression,
    report_ignored,
    triangles_of,
    vertex_block,
)
from usdface.io.gltf.skin_weights import normalised_weights
from usdface.io.gltf.vertex_colours import COLOURS
from usdface.io.gltf.weld import Rows, rows_at, weld_vertices
from usdface.rigs import BlendShape, CornerValues, MaterialSubset, Mesh, Skin

__all__ = ["mesh_of_primitives"]

_DEFAULTS = {COLOURS: np.ones(4), TANGENTS: np.array([1.0, 0.0, 0.0, 1.0])}


def mesh_of_primitives(
    name: str,
    primitives: Sequence[Primitive],
    shape_names: tuple[str, ...],
    materials: tuple[str, ...],
    reader: AccessorReader,
    uv_names: Sequence[str],
) -> tuple[Mesh | None, list[Finding]]:
    """Merge the primitives of one glTF mesh.

    Vertices that agree in position, normal, skin influences and all morph targets become
    one, so that texture seams and borders between materials close again (texture
    coordinates are kept per corner); vertices without a face are left out. The order stays
    that of first appearance.

    Parameters
    ----------
    name : str
    primitives : of pygltflib
    shape_names : tuple of str, length S
        A name for each morph target.
    materials : tuple of str
        Names of the file's materials.
    reader : AccessorReader
    uv_names : sequence of str
        Names of TEXCOORD_0, TEXCOORD_1, ...; else st, st1, ...

    Returns
    -------
    Mesh or None
        In the mesh's own space; its skin counts joints as the glTF skin does. None where
        there is no triangle.
    list of Finding

    Raises
    ------
    InputError
        If primitives disagree in their number of targets or reach beyond their data.
    """
    found: list[Finding] = []
    blocks: dict[tuple[Any, ...], tuple[int, VertexBlock]] = {}
    triangles: list[IntArray] = []
    labels: list[IntArray] = []
    count = 0
    for primitive in primitives:
        attributes = {k: v for k, v in vars(primitive.attributes).items() if v is not None}
        drawn = primitive.mode in (None, TRIANGLES, TRIANGLE_STRIP, TRIANGLE_FAN)
        if not drawn or "POSITION" not in attributes:
            found.append(
                finding(
                    "FEATURE_DROPPED",
                    name,
                    "points and lines are left out",
                    feature="points_and_lines",
                )
            )
            continue
        targets = primitive.targets or []
        if len(targets) != len(shape_names):
            raise InputError(
                f"mesh {name!r}: a primitive has {len(targets)} morph targets, "
                f"another {len(shape_names)}"
            )
        refuse_unknown_compression(primitive, reader, name)
        found += report_ignored(attributes, targets, name)
        key = (tuple(sorted(attributes.items())), *(tuple(sorted(t.items())) for t in targets))
        if key not in blocks:
            blocks[key] = (count, vertex_block(attributes, targets, reader, uv_names))
            count += len(blocks[key][1].points)
        start, block = blocks[key]
        corners = triangles_of(primitive, len(block.points), reader)
        triangles.append(corners + start)
        labels.append(np.full(len(corners), material_of(primitive, materials)))
    if not sum(map(len, triangles)):
        return None, [
            *found,
            finding("FEATURE_DROPPED", name, "a mesh without triangles", feature="mesh"),
        ]
    mesh = _merged(name, [b for _, b in blocks.values()], np.concatenate(triangles), shape_names)
    if mesh.skin is not None:
        weights, new_findings = normalised_weights(mesh.skin.weights, name)
        found += new_findings
        mesh = replace(mesh, skin=Skin(mesh.skin.joints, weights))
    return _with_materials(mesh, np.concatenate(labels), materials), found


def _merged(
    name: str, blocks: list[VertexBlock], triangles: IntArray, shape_names: tuple[str, ...]
) -> Mesh:
    """Concatenate blocks, weld them, and leave out vertices that no face uses."""
    starts = np.cumsum([0, *(len(b.points) for b in blocks)])
    influences = max(b.joints.shape[1] for b in blocks)
    joints = np.concatenate([_padded(b.joints, influences) for b in blocks])
    weights = np.concatenate([_padded(b.weights, influences) for b in blocks])
    points = np.concatenate([b.points for b in blocks])
    # Normals of some primitives only are no normals: the others would be lit as (0, 0, 0).
    given = [b.normals for b in blocks if b.normals is not None]
    normals = np.concatenate(given) if len(given) == len(blocks) else None
    shapes = range(len(shape_names))
    moves = [partial(_stacked, [b.offsets[s] for b in blocks], starts) for s in shapes]
    turns = [
        partial(_stacked, [b.normal_offsets[s] for b in blocks], starts)
        if normals is not None and any(b.normal_offsets[s] is not None for b in blocks)
        else None
        for s in shapes
    ]
    rows = (read() for read in (*moves, *turns) if read is not None)
    columns = [joints, weights] + ([] if normals is None else [normals])
    first, of_vertex = weld_vertices(points, columns, rows)
    used = np.unique(of_vertex[triangles])
    place = np.full(len(first), -1)
    place[used] = np.arange(len(used))
    first = first[used]
    corners = _corners(blocks, triangles)
    first_uvs = next((c.name for c in corners if c.values.shape[1] == 2), "st")
    return Mesh(
        name=name,
        points=points[first],
        face_counts=np.full(len(triangles), 3),
        face_indices=place[of_vertex[triangles.ravel()]],
        normals=None if normals is None else unit_or_zero(normals[first]),
        uvs=next((c.values for c in corners if c.name == first_uvs), None),
        shapes=tuple(
            _shape(n, move(), None if turn is None else turn(), first)
            for n, move, turn in zip(shape_names, moves, turns, strict=True)
        ),
        skin=Skin(joints[first], weights[first]) if influences else None,
        uv_name=first_uvs,
        corner_values=tuple(c for c in corners if c.name != first_uvs),
        flat=not given,
    )


def _corners(blocks: Sequence[VertexBlock], triangles: IntArray) -> list[CornerValues]:
    """Return vertex attributes at the face corners; blocks without the attribute have a default."""
    widths: dict[str, int] = {}
    for block in blocks:
        for name, values in block.corners.items():
            widths[name] = max(widths.get(name, 0), values.shape[1])

    def of(block: VertexBlock, name: str) -> FloatArray:
        filler = np.tile(_DEFAULTS.get(name, np.zeros(2))[: widths[name]], (len(block.points), 1))
        given = block.corners.get(name)
        if given is not None:
            filler[:, : given.shape[1]] = given
        return filler

    return [
        CornerValues(name, np.concatenate([of(b, name) for b in blocks])[triangles.ravel()])
        for name in widths
    ]


def _padded(array: NDArray[Any], width: int) -> NDArray[Any]:
    return np.pad(array, ((0, 0), (0, width - array.shape[1])))


def _stacked(reads: Sequence[ReadRows | None], starts: IntArray) -> Rows:
    rows = [(read(), s) for read, s in zip(reads, starts, strict=False) if read is not None]
    if len(rows) == len(reads) == 1:
        return rows[0][0]
    indices = [np.zeros(0, np.int64), *(r[0] + s for r, s in rows)]
    return np.concatenate(indices), np.concatenate([np.zeros((0, 3)), *(r[1] for r, _ in rows)])


def _shape(name: str, move: Rows, turn: Rows | None, vertices: IntArray) -> BlendShape:
    offsets = rows_at(vertices, *move)
    moved = offsets.any(axis=1)
    if turn is None:
        indices = np.flatnonzero(moved)
        return BlendShape(name, indices, offsets[indices])
    turned = rows_at(vertices, *turn)
    indices = np.flatnonzero(moved | turned.any(axis=1))
    return BlendShape(name, indices, offsets[indices], turned[indices])


def _with_materials(mesh: Mesh, labels: IntArray, materials: tuple[str, ...]) -> Mesh:
    present = list(dict.fromkeys(labels.tolist()))
    if len(present) == 1:
        return replace(mesh, material=materials[present[0]] if present[0] >= 0 else "")
    subsets = [
        MaterialSubset(materials[label], np.flatnonzero(labels == label))
        for label in present
        if label >= 0
    ]
    return replace(mesh, subsets=tuple(subsets))
