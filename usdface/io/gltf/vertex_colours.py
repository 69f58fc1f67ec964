"""Vertex colours: factors of the base colour in glTF, in place of it in USD.

Reading multiplies them by the base colour; writing makes the base colour white. Vertex colours over
a texture multiply it in glTF, which UsdPreviewSurface cannot express.

Source: glTF 2.0 specification, section 3.9.2 (COLOR_0); OpenUSD, UsdGeomGprim.displayColor.
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import pygltflib

from usdface.materials import Material
from usdface.rigs import CornerValues, Mesh, Rig

__all__ = [
    "COLOURS",
    "default_material",
    "has_faces_without_material",
    "is_default_material",
    "multiply_by_base_color",
    "white_base_colors",
]

COLOURS = "displayColor"
_BARE = {"usdface": {"material": False}}
_WHITE = (1.0, 1.0, 1.0)


def has_faces_without_material(rig: Rig) -> bool:
    """Whether vertex colours are on faces without a material.

    glTF's default material is metallic, USD's is not.
    """
    return any(
        mesh.corners(COLOURS) is not None
        and not mesh.material
        and sum(len(s.faces) for s in mesh.subsets) < len(mesh.face_counts)
        for mesh in rig.meshes
    )


def default_material() -> pygltflib.Material:
    """Return a material with the defaults of UsdPreviewSurface, for faces that have none."""
    surface = pygltflib.PbrMetallicRoughness(metallicFactor=0.0, roughnessFactor=0.5)
    return pygltflib.Material(pbrMetallicRoughness=surface, extras=_BARE)


def is_default_material(material: pygltflib.Material) -> bool:
    """Whether it is `default_material`."""
    return bool(material.extras == _BARE)


def multiply_by_base_color(mesh: Mesh, materials: Iterable[Material]) -> Mesh:
    """Return the mesh with its vertex colours multiplied by the base colours of its materials."""
    colours = mesh.corners(COLOURS)
    tints = {m.name: m for m in materials if _multiplies_colours(m)}
    if colours is None or not tints:
        return mesh
    factor = np.ones((len(mesh.face_counts), 4))
    parts = [(mesh.material, np.arange(len(mesh.face_counts)))]
    parts += [(subset.material, subset.faces) for subset in mesh.subsets]
    for name, faces in parts:
        material = tints.get(name)
        factor[faces] = (*material.base_color, material.opacity) if material else 1.0
    each = np.repeat(factor, mesh.face_counts, axis=0)
    values = CornerValues(COLOURS, colours * each[:, : colours.shape[1]])
    others = (c for c in mesh.corner_values if c.name != COLOURS)
    return replace(mesh, corner_values=(*others, values))


def white_base_colors(rig: Rig) -> tuple[Material, ...]:
    """Return the rig's materials, with a white base colour where vertex colours contain it."""
    shown = {
        (name, colours.shape[1] == 4)
        for mesh in rig.meshes
        if (colours := mesh.corners(COLOURS)) is not None
        for name in mesh.materials
    }

    def white(material: Material) -> Material:
        name = material.name
        if not _multiplies_colours(material) or not {(name, True), (name, False)} & shown:
            return material
        opacity = 1.0 if (name, True) in shown else material.opacity
        # The mode stays: only the factor goes.
        mode = material.alpha_mode
        if mode == "opaque" and material.opacity < 1:
            mode = "blend"
        return replace(material, base_color=_WHITE, opacity=opacity, alpha_mode=mode)

    return tuple(white(material) for material in rig.materials)


def _multiplies_colours(material: Material) -> bool:
    return material.vertex_colours and material.base_color_texture is None
