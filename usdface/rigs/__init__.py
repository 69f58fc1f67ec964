"""Rigs: the character, as immutable arrays in metres, Y up, right-handed.

A `Rig` is the value of every rig reader and the input of every rig writer: meshes with blend
shapes, an optional skeleton that skins them, and simple materials.
"""

from usdface.blend_shapes.blend_shape import BlendShape, Combination, CombinationRule, Inbetween
from usdface.materials import Material, Texture
from usdface.rigs.corner_values import CORNER_NORMALS, CornerValues
from usdface.rigs.material_subsets import MaterialSubset, MaterialVariant
from usdface.rigs.mesh import Mesh
from usdface.rigs.rig import Rig
from usdface.rigs.skeleton import Skeleton, Skin

__all__ = [
    "CORNER_NORMALS",
    "BlendShape",
    "Combination",
    "CombinationRule",
    "CornerValues",
    "Inbetween",
    "Material",
    "MaterialSubset",
    "MaterialVariant",
    "Mesh",
    "Rig",
    "Skeleton",
    "Skin",
    "Texture",
]
