"""Polygon meshes to glTF: triangles, one uv per vertex, dense vertex attributes."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pygltflib
from pygltflib import ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER

from usdface.arrays import FloatArray, IntArray
from usdface.errors import OutputError
from usdface.findings import Finding, finding
from usdface.geometry.bake_transform import TANGENTS
from usdface.geometry.triangulation import triangulated
from usdface.geometry.vertex_normals import NormalsNear, normals_of_faces, unit_or_up
from usdface.io.gltf.buffer import BufferBuilder
from usdface.io.gltf.inbetweens import flat_mesh
from usdface.io.gltf.vertex_colours import COLOURS
from usdface.io.gltf.vertex_split import (
    split_vertices,
    tangent_deltas,
    texcoord_count,
    write_corner_attributes,
    write_vertex_colours,
)
from usdface.io.gltf.write_skin import write_influences
from usdface.numerics.matching_rows import matching_rows
from usdface.rigs import BlendShape, Mesh

__all__ = ["write_mesh"]

_LEAST_NORMAL_CHANGE = 1e-6  # of a computed unit normal: a 3,900th of a step of 8-bit shading


def write_mesh(
    mesh: Mesh,
    materials: Mapping[str, pygltflib.Material],
    builder: BufferBuilder,
    joints: int,
    uv_names: Sequence[str] = ("st",),
    coloured: Collection[str] = ("",),
) -> tuple[pygltflib.Mesh | None, list[Finding]]:
    """Append a mesh's accessors to `builder` and return the glTF mesh.

    All primitives, one for each material subset and one for the faces in none, share the
    vertices and morph targets; so every target exists in every primitive, in one order,
    and a reader that joins the primitives gets the points back in theirs. Normals and
    their change by each shape are authored ones, else smooth ones; a flat mesh has none.

    Parameters
    ----------
    mesh : Mesh
    materials : mapping
        The document's materials by name, in order.
    builder : BufferBuilder
    joints : int
        Joints of the skeleton; 0 leaves the skin out.
    uv_names : sequence of str
        Primvars of TEXCOORD_0, TEXCOORD_1, ... (`usdface.io.gltf.vertex_split.uv_order`).
    coloured : collection of str
        Materials that show vertex colours; "" is the lack of one.

    Returns
    -------
    pygltflib.Mesh or None
        None where there is no triangle.
    list of Finding

    Raises
    ------
    OutputError
        If a number does not fit float32, or a subset or the skin does not fit the mesh.
    """
    corners, faces = triangulated(mesh.face_counts, mesh.face_indices, mesh.points)
    if not len(corners):
        return None, [
            finding(
                "FEATURE_DROPPED", mesh.name, "a mesh without faces is left out", feature="mesh"
            )
        ]
    found = _report_dropped(mesh)
    if mesh.flat:  # tangents mean nothing without normals (section 3.7.2.1)
        others = tuple(c for c in mesh.corner_values if c.name != TANGENTS)
        mesh = replace(mesh, corner_values=others)
    mesh, inbetweens, new_findings = flat_mesh(mesh)
    found += new_findings
    shows = set(mesh.materials) & set(coloured)
    if mesh.corners(COLOURS) is not None and not shows:
        message = "displayColor is left out: its material does not show it"
        found.append(finding("CHANNEL_IGNORED", mesh.name, message))
    held = [c.values for c in mesh.corner_values if shows or c.name != COLOURS]
    held += [] if mesh.uvs is None else [mesh.uvs]
    split = split_vertices(mesh, corners, held)
    primitives = _primitives(mesh, split.vertex[corners], faces, materials, builder, found)
    shared = pygltflib.Attributes(
        POSITION=builder.array(mesh.points[split.source], ARRAY_BUFFER, bounds=True, short="signed")
    )
    moves = [_target(s.indices, s.offsets, split.source, builder) for s in mesh.shapes]
    normals, turns = _normals(mesh)  # of numbers that are now known to fit float32
    if not mesh.flat:
        lit = unit_or_up(normals[split.source])
        shared.NORMAL = builder.array(lit, ARRAY_BUFFER, short="signed")
    wanted = texcoord_count(primitives, materials)
    attributes = write_corner_attributes(mesh, split, uv_names, wanted, builder)
    if joints and mesh.skin is not None:
        count = len(mesh.points)
        influences, new_findings = write_influences(
            mesh.skin, split.source, count, joints, mesh.name, builder
        )
        found += new_findings
        attributes |= influences
    for attribute, accessor in attributes.items():
        setattr(shared, attribute, accessor)
    targets = [{"POSITION": move} for move in moves]
    for target, turn in zip(targets, [] if mesh.flat else turns, strict=False):
        target["NORMAL"] = _target(*turn, split.source, builder)
    tangents = mesh.corners(TANGENTS)
    if tangents is not None:
        for target, turn in zip(targets, turns, strict=True):
            turned = tangent_deltas(tangents, split, normals, turn)
            target["TANGENT"] = builder.offsets(*turned, len(split.source))
    tint = write_vertex_colours(mesh, split, builder) if shows else None
    _share(primitives, shared, targets, tint, [name in shows for name in ("", *materials)])
    at_rest, extras = [0.0] * len(mesh.shapes), _named_targets(mesh, inbetweens)
    name = mesh.content_name or mesh.name
    whole = pygltflib.Mesh(name=name, primitives=primitives, weights=at_rest, extras=extras)
    return whole, found


def _share(
    primitives: Sequence[pygltflib.Primitive],
    attributes: pygltflib.Attributes,
    targets: list[dict[str, int]],
    tint: int | None,
    tinted: Sequence[bool],
) -> None:
    """Give primitives their common vertices and targets; vertex colours where they are shown.

    `tinted` are no material, then each of the document's.
    """
    for primitive in primitives:
        primitive.attributes, primitive.targets = attributes, targets
        place = 0 if primitive.material is None else primitive.material + 1
        if tint is not None and tinted[place]:
            primitive.attributes = pygltflib.Attributes(**vars(attributes) | {"COLOR_0": tint})


def _named_targets(mesh: Mesh, inbetweens: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the extras of a mesh: names of its morph targets, and which are inbetweens."""
    extras: dict[str, Any] = {}
    if mesh.shapes:
        extras["targetNames"] = [shape.label or shape.name for shape in mesh.shapes]
    ours: dict[str, Any] = {"inbetweens": inbetweens} if inbetweens else {}
    if any(shape.label for shape in mesh.shapes):
        ours["names"] = list(mesh.shape_names)
    return extras | ({"usdface": ours} if ours else {})


def _report_dropped(mesh: Mesh) -> list[Finding]:
    found = []
    if (mesh.face_counts > 3).any():
        found.append(finding("FACES_TRIANGULATED", mesh.name))
    if unseen := _unseen(mesh):
        message = "parts that show nothing are left out: {channels}"
        found.append(finding("CHANNEL_IGNORED", mesh.name, message, unseen))
    if mesh.normals is None and not mesh.flat:
        found.append(finding("NORMALS_COMPUTED", mesh.name))
    combined = [shape.name for shape in mesh.shapes if shape.combination is not None]
    if combined:
        message = "combination shapes become plain ones, with their weights: {shapes}"
        found.append(
            finding("FEATURE_DROPPED", mesh.name, message, combined, feature="combination_shapes")
        )
    return found


def _unseen(mesh: Mesh) -> list[str]:
    """Return in words the faces without a surface, and the points of no face with one."""
    flat = mesh.face_counts < 3
    shown = mesh.face_indices[np.repeat(~flat, mesh.face_counts)]
    parts = {
        "faces of fewer than three corners": int(flat.sum()),
        "points of no face": len(mesh.points) - len(np.unique(shown)),
    }
    return [f"{count} {part}" for part, count in parts.items() if count]


def _primitives(
    mesh: Mesh,
    triangles: IntArray,
    faces: IntArray,
    materials: Mapping[str, pygltflib.Material],
    builder: BufferBuilder,
    found: list[Finding],
) -> list[pygltflib.Primitive]:
    label = np.full(len(mesh.face_counts), len(mesh.subsets))
    for place, subset in reversed(list(enumerate(mesh.subsets))):
        if len(subset.faces) and not 0 <= subset.faces.min() <= subset.faces.max() < len(label):
            raise OutputError(
                f"mesh {mesh.name!r}: a face of material subset {subset.material!r} is outside "
                f"0 to {len(label) - 1}"
            )
        label[subset.faces] = place
    names = [*(subset.material for subset in mesh.subsets), mesh.material]
    index = {name: place for place, name in enumerate(materials)}
    primitives = []
    for place, name in enumerate(names):
        chosen = triangles[label[faces] == place]
        if not len(chosen):
            continue
        if name and name not in index:
            message = "the rig has no material {material!r}"
            found.append(finding("FEATURE_DROPPED", mesh.name, message, name, feature="material"))
        width = np.uint16 if chosen.max() < 2**16 - 1 else np.uint32
        corners = builder.array(chosen.reshape(-1, 1).astype(width), ELEMENT_ARRAY_BUFFER)
        primitives.append(pygltflib.Primitive(indices=corners, material=index.get(name)))
    return primitives


def _normals(mesh: Mesh) -> tuple[FloatArray, list[tuple[IntArray, FloatArray]]]:
    """Return vertex normals (V, 3) and, for each shape, where and how it changes them.

    A shape without normal offsets gets the change of the smooth normals at weight 1, also where
    the neutral normals are authored.
    """
    if mesh.flat:
        return np.zeros_like(mesh.points), []
    authored = [(s.indices, s.normal_offsets) for s in mesh.shapes if s.normal_offsets is not None]
    if mesh.normals is not None and len(authored) == len(mesh.shapes):
        return mesh.normals, authored
    faces = mesh.face_counts, mesh.face_indices, len(mesh.points)
    near = NormalsNear(*faces)
    resting = normals_of_faces(*faces)(mesh.points)

    def turn(shape: BlendShape) -> tuple[IntArray, FloatArray]:
        if shape.normal_offsets is not None:
            return shape.indices, shape.normal_offsets
        points = mesh.points.copy()
        points[shape.indices] += shape.offsets
        ring = near.ring(shape.indices)
        change = near.at(points, ring) - resting[ring]
        turned = (np.abs(change) > _LEAST_NORMAL_CHANGE).any(axis=1)
        return ring[turned], change[turned]

    normals = resting if mesh.normals is None else mesh.normals
    return normals, [turn(shape) for shape in mesh.shapes]


def _target(indices: IntArray, values: FloatArray, source: IntArray, builder: BufferBuilder) -> int:
    """Append a morph target: values at points `indices` go to every vertex of those points."""
    moved, rows = matching_rows(indices, source)
    return builder.offsets(moved, values[rows], len(source))
