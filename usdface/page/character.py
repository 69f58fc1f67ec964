"""The character of a page: meshes as triangles, blend shapes as targets, joints."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.blend_shapes.blend_shape import BlendShape
from usdface.blend_shapes.inbetween_path import distinct_inbetweens, inbetween_path
from usdface.geometry.triangulation import triangle_fans
from usdface.materials import Material, Placement
from usdface.page.packed_data import Quantized
from usdface.rigs import Mesh, Rig, Skeleton, Skin

__all__ = ["JOINTS_SHOWN", "character_data", "page_meshes"]

# Joints of a point that a page's renderer reads.
JOINTS_SHOWN = 4


def page_meshes(rig: Rig, face_only: bool) -> tuple[Mesh, ...]:
    """Return the meshes that a page shows: all, or those that blend shapes move."""
    moved = tuple(mesh for mesh in rig.meshes if any(s.offsets.any() for s in mesh.shapes))
    return moved if face_only and moved else rig.meshes


def character_data(
    rig: Rig, meshes: tuple[Mesh, ...], images: Mapping[str, str] = MappingProxyType({})
) -> dict[str, Any]:
    """Return the character as a tree for `usdface.page.packed_data.pack_data`.

    Parameters
    ----------
    rig : Rig
    meshes : tuple of Mesh
        Those of the rig to show.
    images : mapping of str to str
        The image of the base colour of each textured material, as a ``data:`` address; those of
        other materials are not shown.
    """
    materials = _materials(rig, meshes)
    names = list(dict.fromkeys(name for mesh in meshes for name in mesh.shape_names))
    place = {name: i for i, name in enumerate(names)}
    return {
        "shapes": names,
        "combinations": _combinations(meshes, place),
        "materials": [_material(material, images.get(material.name)) for material in materials],
        "meshes": [_mesh(mesh, place, materials, images) for mesh in meshes],
        "joints": _joints(rig.skeleton),
    }


def _materials(rig: Rig, meshes: tuple[Mesh, ...]) -> list[Material]:
    used = {name for mesh in meshes for name in mesh.materials}
    return [Material(""), *(m for m in rig.materials if m.name in used)]


def _material(material: Material, image: str | None) -> dict[str, Any]:
    placed = material.base_color_texture.placed if material.base_color_texture else Placement()
    textures = material.base_color_texture, material.opacity_texture
    cut = image is not None and all(textures) and textures[0].image == textures[1].image  # type: ignore[union-attr]
    return {
        "name": material.name,
        "image": image,
        "wrap": list(placed.wrap),
        # The image's own alpha counts where it is the opacity, too.
        "alpha": material.alpha_mode if cut else "opaque",
        "cutoff": material.alpha_cutoff,
        "colour": list(material.base_color),
        "opacity": 1.0 if material.alpha_mode == "opaque" else material.opacity,
        "metallic": material.metallic,
        "roughness": material.roughness,
        "two_sided": material.double_sided,
    }


def _mesh(
    mesh: Mesh, place: dict[str, int], materials: list[Material], images: Mapping[str, str]
) -> dict[str, Any]:
    number = {material.name: i for i, material in enumerate(materials)}
    corners, face = triangle_fans(mesh.face_counts)
    own = np.full(len(mesh.face_counts), number.get(mesh.material, 0))
    for subset in mesh.subsets:
        own[subset.faces] = number.get(subset.material, 0)
    material = own[face]
    order = np.argsort(material, kind="stable")
    starts = np.flatnonzero(np.diff(material[order], prepend=-1))
    counts = np.diff(starts, append=len(order))
    return {
        "name": mesh.name,
        "points": mesh.points.astype(np.float32),
        "triangles": mesh.face_indices[corners[order]],
        "texture": _texture(mesh, corners[order], [materials[i] for i in material[order]], images),
        "groups": [
            {"start": 3 * s, "count": 3 * c, "material": int(material[order[s]])}
            for s, c in zip(starts.tolist(), counts.tolist(), strict=True)
        ],
        "shapes": [_shape(shape, place[shape.name]) for shape in mesh.shapes if _moves(shape)],
        "skin": _skin(mesh.skin),
    }


def _texture(
    mesh: Mesh, corners: IntArray, materials: list[Material], images: Mapping[str, str]
) -> dict[str, Any] | None:
    """Return the texture coordinates of triangles whose corners are given; None without any.

    Where they part a vertex there are several of it: `source` (N,) is the vertex of each,
    `triangles` (T, 3) are indices of these.
    """
    coordinates = np.zeros((len(mesh.face_indices), 2))
    shown = False
    for material in {m.name: m for m in materials if m.name in images}.values():
        placed = material.base_color_texture.placed if material.base_color_texture else Placement()
        uvs = mesh.uv_sets.get(placed.uv)
        if uvs is None:
            continue
        own = corners[[m.name == material.name for m in materials]].ravel()
        coordinates[own] = _placed(uvs[own], placed)
        shown = True
    if not shown:
        return None
    rows = np.column_stack([mesh.face_indices[corners.ravel()], coordinates[corners.ravel()]])
    unique, vertex = np.unique(rows, axis=0, return_inverse=True)
    return {
        "source": unique[:, 0].astype(np.int64),
        "coordinates": Quantized(unique[:, 1:]),
        "triangles": vertex.reshape(corners.shape),
    }


def _placed(uvs: FloatArray, placed: Placement) -> FloatArray:
    """Return texture coordinates scaled, turned counter-clockwise, then moved."""
    sine, cosine = np.sin(placed.rotation), np.cos(placed.rotation)
    turned = (uvs * placed.scale) @ [[cosine, sine], [-sine, cosine]]
    return np.asarray(turned + placed.offset)


def _moves(shape: BlendShape) -> bool:
    between = (each.offsets.any() for each in shape.inbetweens)
    return bool(shape.offsets.any() or any(between))


def _shape(shape: BlendShape, number: int) -> dict[str, Any]:
    """Return one blend shape: where it and its inbetweens move vertices, at which weights."""
    path = inbetween_path(shape)
    knots = [k for k, weight in enumerate(path.weights.tolist()) if weight != 0]
    offsets = path.displacements.reshape(len(path.weights), -1, 3)[knots]
    moved = np.flatnonzero(np.abs(offsets).max(axis=(0, 2), initial=0.0) > 0)
    # Each target has its own steps: those of a lid are finer than those of a jaw.
    return {
        "shape": number,
        "weights": path.weights[knots].tolist(),
        "names": [
            *("" if weight == 1 else _between(shape, weight) for weight in path.weights[knots])
        ],
        "vertices": shape.indices[moved],
        "offsets": [Quantized(offset[moved]) for offset in offsets],
    }


def _between(shape: BlendShape, weight: float) -> str:
    return next(each.name for each in distinct_inbetweens(shape) if each.weight == weight)


def _combinations(meshes: tuple[Mesh, ...], place: dict[str, int]) -> list[dict[str, Any]]:
    """Return the combination shapes, parents before those that build on them."""
    declared = {
        shape.name: shape.combination
        for mesh in meshes
        for shape in mesh.shapes
        if shape.combination is not None
        and shape.combination.rule != "limit"
        and set(shape.combination.of) <= set(place)
    }
    ordered: list[str] = []
    while ready := [
        name
        for name, combination in declared.items()
        if name not in ordered
        and not {parent for parent in combination.of if parent in declared} - set(ordered)
    ]:
        ordered += ready
    return [
        {
            "shape": place[name],
            "of": [place[parent] for parent in declared[name].of],
            "least": declared[name].rule == "min",
        }
        for name in ordered
    ]


def _skin(skin: Skin | None) -> dict[str, Any] | None:
    """Return the joints that move each vertex most, at most `JOINTS_SHOWN`, with sum 1."""
    if skin is None:
        return None
    order = np.argsort(-skin.weights, axis=1, kind="stable")[:, :JOINTS_SHOWN]
    weights = np.take_along_axis(skin.weights, order, 1)
    joints = np.take_along_axis(skin.joints, order, 1)
    total = weights.sum(axis=1, keepdims=True)
    weights = np.where(total > 0, weights / np.where(total > 0, total, 1.0), 0.0)
    return {"joints": joints, "weights": Quantized(weights)}


def _joints(skeleton: Skeleton | None) -> dict[str, Any] | None:
    if skeleton is None:
        return None
    return {
        "parents": list(skeleton.parents),
        "rest": skeleton.rest.reshape(-1).tolist(),
        "bind": skeleton.bind.reshape(-1).tolist(),
    }
