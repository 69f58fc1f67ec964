"""Materials: the common part of UsdPreviewSurface and glTF's metallic-roughness model.

Values multiply their textures, as in glTF. Texture coordinates are v up, as in USD.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, Literal

__all__ = ["AlphaMode", "Colour", "ColourSpace", "Material", "Placement", "Texture", "Wrap"]

AlphaMode = Literal["opaque", "mask", "blend"]
ColourSpace = Literal["auto", "sRGB", "raw"]
Wrap = Literal["repeat", "mirror", "clamp"]
Colour = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Placement:
    """The placement of an image on a mesh: texture coordinates, their transform, wrapping.

    Attributes
    ----------
    uv : str
        Name of the texture coordinates (`usdface.rigs.Mesh`).
    wrap : (str, str)
        Beyond the image's edges, along u and v.
    filters : (int, int)
        glTF's numbers of the magnification and minification filter, 0 = any. USD has none.
    scale, rotation, offset : (2,) [1], float [rad], (2,) [1]
        Coordinates are scaled, turned counter-clockwise, then moved; v up.
    texture_name : str
        Name of the texture in glTF, if it has one; it makes no difference.
    """

    uv: str = "st"
    wrap: tuple[Wrap, Wrap] = ("repeat", "repeat")
    filters: tuple[int, int] = (0, 0)
    scale: tuple[float, float] = (1.0, 1.0)
    rotation: float = 0.0
    offset: tuple[float, float] = (0.0, 0.0)
    texture_name: str = field(default="", compare=False)

    @property
    def moved(self) -> bool:
        """Whether coordinates are transformed at all."""
        return (self.scale, self.rotation, self.offset) != ((1.0, 1.0), 0.0, (0.0, 0.0))


@dataclass(frozen=True, slots=True)
class Texture:
    """An image on a surface: a file on disk, or bytes that came inside a container.

    `channel` ("r", "g", "b", "a") is the source of a single number. In a `path`,
    ``<UDIM>`` stands for the number of a tile. `image_name` is that of the image in glTF, if it has
    one; it makes no difference.
    """

    path: str = ""
    data: bytes | None = None
    suffix: str = ""
    channel: str = ""
    space: ColourSpace = "auto"
    placed: Placement = Placement()
    image_name: str = field(default="", compare=False)

    @property
    def image(self) -> tuple[str, bytes | None, str, str]:
        """The identity of an image, wherever and however it is used."""
        return self.path, self.data, self.suffix, self.space


@dataclass(frozen=True, slots=True)
class Material:
    """A surface.

    `alpha_cutoff` counts for the mode "mask" only. With `vertex_colours` the ``displayColor`` of
    a mesh that has one stands for the base colour, or multiplies its texture; `unlit` shows it
    without any light.
    `emissive` may exceed 1. `extras` are user data.
    """

    name: str
    base_color: Colour = (0.8, 0.8, 0.8)
    opacity: float = 1.0
    metallic: float = 0.0
    roughness: float = 0.5
    emissive: Colour = (0.0, 0.0, 0.0)
    double_sided: bool = False
    alpha_mode: AlphaMode = "opaque"
    alpha_cutoff: float = 0.5
    ior: float = 1.5
    clearcoat: float = 0.0
    clearcoat_roughness: float = 0.01
    normal_scale: float = 1.0
    occlusion_strength: float = 1.0
    vertex_colours: bool = False
    unlit: bool = False
    base_color_texture: Texture | None = None
    opacity_texture: Texture | None = None
    metallic_texture: Texture | None = None
    roughness_texture: Texture | None = None
    normal_texture: Texture | None = None
    occlusion_texture: Texture | None = None
    emissive_texture: Texture | None = None
    extras: Mapping[str, Any] = field(default_factory=dict, hash=False)

    @property
    def textures(self) -> dict[str, Texture]:
        """The textures by the names of their fields."""
        slots = (f.name for f in fields(self) if f.name.endswith("_texture"))
        return {slot: value for slot in slots if (value := getattr(self, slot)) is not None}
