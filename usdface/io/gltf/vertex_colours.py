"""Vertex colours: glTF multiplies them with the material's colour, USD shows them instead of it.

So on the way in the colour goes into them, and on the way out the material becomes white. With a
texture they multiply it, which UsdPreviewSurface cannot show.

Source: glTF 2.0 specification, section 3.9.2 (COLOR_0); OpenUSD, UsdGeomGprim.displayColor.
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import pygltflib

from usdface.materials import Material
from usdface.rigs import CornerValues, Mesh, Rig

__all__ = ["COLOURS", "bare", "bare_material", "is_bare", "tinted", "whitened"]

COLOURS = "displayColor"
_BARE = {"usdface": {"material": False}}
_WHITE = (1.0, 1.0, 1.0)


def bare(rig: Rig) -> bool:
    """Whether vertex colours are on faces without a material.

    What glTF shows without one is metal, which USD's colours alone are not.
    """
    return any(
        mesh.corners(COLOURS) is not None
        and not mesh.material
        and sum(len(s.faces) for s in mesh.subsets) < len(mesh.face_counts)
        for mesh in rig.meshes
    )


def bare_material() -> pygltflib.Material:
    """Return what stands for no material, with UsdPreviewSurface's defaults."""
    surface = pygltflib.PbrMetallicRoughness(metallicFactor=0.0, roughnessFactor=0.5)
    return pygltflib.Material(pbrMetallicRoughness=surface, extras=_BARE)


def is_bare(material: pygltflib.Material) -> bool:
    """Whether it is `bare_material`."""
    return bool(material.extras == _BARE)


def tinted(mesh: Mesh, materials: Iterable[Material]) -> Mesh:
    """Return the mesh with its vertex colours multiplied by those of its materials."""
    colours = mesh.corners(COLOURS)
    tints = {m.name: m for m in materials if _alone(m)}
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


def whitened(rig: Rig) -> tuple[Material, ...]:
    """Return the rig's materials, white where vertex colours stand for theirs."""
    shown = {
        (name, colours.shape[1] == 4)
        for mesh in rig.meshes
        if (colours := mesh.corners(COLOURS)) is not None
        for name in (mesh.material, *(s.material for s in mesh.subsets))
    }

    def white(material: Material) -> Material:
        name = material.name
        if not _alone(material) or not {(name, True), (name, False)} & shown:
            return material
        opacity = 1.0 if (name, True) in shown else material.opacity
        # The mode stays: only the factor goes.
        mode = material.alpha_mode
        if mode == "opaque" and material.opacity < 1:
            mode = "blend"
        return replace(material, base_color=_WHITE, opacity=opacity, alpha_mode=mode)

    return tuple(white(material) for material in rig.materials)


def _alone(material: Material) -> bool:
    return material.vertex_colours and material.base_color_texture is None
