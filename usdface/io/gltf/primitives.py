"""Primitives of glTF meshes: their vertices, triangles and materials.

Source: glTF 2.0 specification, section 3.7.2 (meshes, morph targets, primitive modes).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from pygltflib import TRIANGLE_FAN, TRIANGLE_STRIP, Primitive

from usdface.arrays import FloatArray, IntArray
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.geometry.bake_transform import TANGENTS
from usdface.io.gltf.accessors import AccessorReader
from usdface.io.gltf.document import item
from usdface.io.gltf.textures import uv_name
from usdface.io.gltf.vertex_colours import COLOURS
from usdface.io.gltf.weld import Rows

__all__ = [
    "ReadRows",
    "VertexBlock",
    "material_of",
    "refuse_unknown_compression",
    "report_ignored",
    "triangles_of",
    "vertex_block",
]

ReadRows = Callable[[], Rows]


@dataclass(frozen=True, eq=False, slots=True)
class VertexBlock:
    """The vertices that primitives with the same attributes share.

    Morph targets are decoded when they are needed: all at once take most of a face's memory.
    """

    points: FloatArray
    normals: FloatArray | None
    corners: dict[str, FloatArray]
    joints: IntArray
    weights: FloatArray
    offsets: tuple[ReadRows | None, ...]
    normal_offsets: tuple[ReadRows | None, ...]


def refuse_unknown_compression(primitive: Primitive, reader: AccessorReader, name: str) -> None:
    """Refuse positions that no buffer holds, where an extension of the primitive may."""
    place = item(reader.file.document.accessors or [], primitive.attributes.POSITION, "accessor")
    if primitive.extensions and place.bufferView is None and place.sparse is None:
        raise InputError(
            f"mesh {name!r} has its positions in {', '.join(sorted(primitive.extensions))}, which "
            "usdface does not decode; export it without",
            "EXTENSION_UNSUPPORTED",
        )


def report_ignored(
    attributes: dict[str, Any], targets: Sequence[dict[str, Any]], name: str
) -> list[Finding]:
    """Return findings about vertex attributes that are not read."""
    read = ("POSITION", "NORMAL", "TANGENT", "TEXCOORD_", "COLOR_0", "JOINTS_", "WEIGHTS_")
    left = sorted(a for a in attributes if not a.startswith(read))
    found = [
        finding(
            "FEATURE_DROPPED",
            name,
            "vertex attribute {attribute} is left out",
            a,
            feature="vertex_attribute",
        )
        for a in left
    ]
    moves = {a for target in targets for a in target}
    if "TANGENT" in moves:
        found.append(finding("TANGENTS_COMPUTED", name))
    for moved in sorted(moves - {"POSITION", "NORMAL", "TANGENT"}):
        message = "changes of {attribute} by blend shapes are left out"
        found.append(finding("FEATURE_DROPPED", name, message, moved, feature="morph_attribute"))
    return found


def material_of(primitive: Primitive, materials: tuple[str, ...]) -> int:
    """Return the index of a primitive's material; -1 for none."""
    index = primitive.material
    if index is not None and not 0 <= index < len(materials):
        raise InputError(f"there is no material {index}; the file has {len(materials)}")
    if index is not None and not materials[index]:  # stands for none
        return -1
    return -1 if index is None else int(index)


def triangles_of(primitive: Primitive, count: int, reader: AccessorReader) -> IntArray:
    """Return the vertices (T, 3) of a primitive's triangles, of `count` vertices."""
    corners = np.arange(count)
    if primitive.indices is not None:
        corners = reader.integers(primitive.indices, "SCALAR")[:, 0]
        if corners.min() < 0 or corners.max() >= count:
            raise InputError(
                f"index accessor {primitive.indices} points outside the {count} vertices"
            )
    if primitive.mode == TRIANGLE_STRIP:
        turn = np.arange(max(len(corners) - 2, 0)) % 2
        place = np.arange(len(turn))
        # every second triangle of a strip turns the other way
        return np.stack([corners[place], corners[place + 1 + turn], corners[place + 2 - turn]], 1)
    if primitive.mode == TRIANGLE_FAN:
        fan = np.stack([corners[1:-1], corners[2:]], 1)
        return np.concatenate([np.full((len(fan), 1), corners[0]), fan], 1)
    return corners[: len(corners) // 3 * 3].reshape(-1, 3)


def vertex_block(
    attributes: dict[str, Any],
    targets: Sequence[dict[str, Any]],
    reader: AccessorReader,
    uv_names: Sequence[str],
) -> VertexBlock:
    """Return the vertices of a primitive, with morph targets that are read when they are needed."""
    points = reader.floats(attributes["POSITION"], "VEC3")
    count = len(points)

    def rows(attribute: str, kind: str) -> FloatArray | None:
        if attribute not in attributes:
            return None
        values = reader.floats(attributes[attribute], kind)
        if len(values) != count:
            raise InputError(f"{attribute} has {len(values)} elements for {count} vertices")
        return values

    joints: list[IntArray] = [np.zeros((count, 0), np.int64)]
    weights: list[FloatArray] = [np.zeros((count, 0))]
    while f"JOINTS_{len(joints) - 1}" in attributes:
        place = len(joints) - 1
        weight = rows(f"WEIGHTS_{place}", "VEC4")
        joint = reader.integers(attributes[f"JOINTS_{place}"], "VEC4")
        if weight is None or len(joint) != count:
            raise InputError(f"JOINTS_{place} has no WEIGHTS_{place} for each vertex")
        joints.append(joint)
        weights.append(weight)
    corners: dict[str, FloatArray] = {}
    while (uvs := rows(f"TEXCOORD_{len(corners)}", "VEC2")) is not None:
        corners[uv_name(len(corners), uv_names)] = uvs * (1, -1) + (0, 1)
    colours = rows("COLOR_0", reader.kind(attributes.get("COLOR_0"), ("VEC3", "VEC4")))
    tangents = rows("TANGENT", "VEC4")
    if colours is not None:
        corners[COLOURS] = colours
    if tangents is not None:
        corners[TANGENTS] = tangents

    def moved(attribute: str) -> tuple[ReadRows | None, ...]:
        places = (target.get(attribute) for target in targets)
        return tuple(None if p is None else partial(reader.offsets, p, count) for p in places)

    return VertexBlock(
        points,
        rows("NORMAL", "VEC3"),
        corners,
        np.concatenate(joints, 1),
        np.concatenate(weights, 1),
        moved("POSITION"),
        moved("NORMAL"),
    )
