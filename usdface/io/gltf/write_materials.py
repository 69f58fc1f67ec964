"""Materials to glTF: factors, packed textures, and extensions of the core.

Source: glTF 2.0 specification, section 3.9; KHR_materials_emissive_strength, _ior, _unlit and
_clearcoat.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import pygltflib

from usdface.findings import Finding, finding
from usdface.io.gltf.extras import extras_with_metadata
from usdface.io.gltf.image import GltfImage, channels_image, to_gltf_image
from usdface.io.gltf.image_kind import has_alpha
from usdface.io.gltf.textures import TextureBuilder
from usdface.materials import AlphaMode, Material, Texture

__all__ = ["write_materials"]


def write_materials(
    materials: Iterable[Material], textures: TextureBuilder
) -> tuple[list[pygltflib.Material], list[Finding]]:
    """Return materials for a document, their images put into `textures`.

    Roughness and metallic become the green and blue of one image, opacity the alpha of the base
    colour's; images that are so already pass unchanged. Values outside glTF's ranges are clamped.
    """
    found: list[Finding] = []
    images = _Images(found)
    written = [_written(material, textures, images, found) for material in materials]
    return written, found + textures.findings


class _Images:
    """The images of a document, each made once, however many materials show it."""

    def __init__(self, found: list[Finding]) -> None:
        self._made: dict[Any, GltfImage | None] = {}
        self._found = found

    def plain(self, texture: Texture | None, colour: bool) -> GltfImage | None:
        """Return the image of a texture as it is."""
        if texture is None:
            return None
        return self._once((texture.image, colour), lambda: to_gltf_image(texture, colour))

    def packed(self, planes: Sequence[Texture | None], colour: bool = False) -> GltfImage | None:
        """Return an image of channels: of single numbers, or of a colour and its opacity."""
        key = (*(p and (p.image, p.channel) for p in planes), colour)
        return self._once(key, lambda: channels_image(planes, colour))

    def _once(
        self, key: Any, make: Callable[[], tuple[GltfImage | None, list[Finding]]]
    ) -> GltfImage | None:
        if key not in self._made:
            self._made[key], new_findings = make()
            self._found.extend(new_findings)
        return self._made[key]


def _written(
    material: Material, textures: TextureBuilder, images: _Images, found: list[Finding]
) -> pygltflib.Material:
    where = f"material {material.name}"
    mode = material.alpha_mode
    if mode == "opaque" and (material.opacity < 1 or material.opacity_texture):
        mode = "blend"

    def info(kind: Any, texture: Texture | None, chosen: GltfImage | None) -> Any:
        if texture is None or chosen is None:
            return None
        return textures.info(kind, chosen, texture, where)

    base, rough = material.base_color_texture, material.roughness_texture
    alpha = _joint_texture(material.opacity_texture, base, "opacity", where, found)
    colours = _colours(base, alpha, mode, images)
    metal = _joint_texture(material.metallic_texture, rough, "metallic", where, found)
    shine = _metallic_roughness(rough, metal, images)
    hollow, normal, glow = (
        material.occlusion_texture,
        material.normal_texture,
        material.emissive_texture,
    )
    one_channel = hollow is not None and hollow.channel not in ("", "r")
    hollows = images.packed((hollow,) * 3) if one_channel else images.plain(hollow, False)
    result = pygltflib.Material(
        name=material.name,
        pbrMetallicRoughness=pygltflib.PbrMetallicRoughness(
            baseColorTexture=info(pygltflib.TextureInfo, base or alpha, colours),
            metallicRoughnessTexture=info(pygltflib.TextureInfo, rough or metal, shine),
        ),
        normalTexture=info(pygltflib.NormalMaterialTexture, normal, images.plain(normal, False)),
        occlusionTexture=info(pygltflib.OcclusionTextureInfo, hollow, hollows),
        emissiveTexture=info(pygltflib.TextureInfo, glow, images.plain(glow, True)),
        alphaMode=mode.upper(),
        alphaCutoff=max(material.alpha_cutoff, 0.0) if mode == "mask" else None,
        doubleSided=material.double_sided,
        extras=extras_with_metadata(material.extras),
    )
    _set_factors(result, material, found)
    return result


def _colours(
    base: Texture | None, alpha: Texture | None, mode: AlphaMode, images: _Images
) -> GltfImage | None:
    """Return the image of colour and opacity; an unused opacity is taken out."""
    if alpha is not None and not _same_channel(alpha, base, "a"):
        return images.packed((base, alpha), colour=True)
    colours = images.plain(base, True)
    if alpha is None and mode != "opaque" and colours and has_alpha(colours[0]):
        return images.packed((base, None), colour=True)
    return colours


def _metallic_roughness(
    rough: Texture | None, metal: Texture | None, images: _Images
) -> GltfImage | None:
    """Return the image that has roughness in green and metallic in blue."""
    if _same_channel(rough, metal, "g") and _same_channel(metal, rough, "b"):
        return images.plain(rough, False)
    return images.packed((None, rough, metal))


def _set_factors(result: pygltflib.Material, material: Material, found: list[Finding]) -> None:
    """Set the numbers of a material, and the extensions that some of them need."""
    strength = max(1.0, *material.emissive)
    glow = [value / strength for value in material.emissive]
    values = [*material.base_color, material.opacity, material.metallic, material.roughness]
    values += [*glow, material.clearcoat, material.clearcoat_roughness]
    if not all(0 <= value <= 1 for value in values) or material.alpha_cutoff < 0:
        message = "a value outside 0 to 1 is clamped"
        found.append(
            finding(
                "FEATURE_DROPPED", f"material {material.name}", message, feature="material_value"
            )
        )
    pbr = result.pbrMetallicRoughness
    pbr.baseColorFactor = [_clamped(v) for v in (*material.base_color, material.opacity)]
    pbr.metallicFactor = _clamped(material.metallic)
    pbr.roughnessFactor = _clamped(material.roughness)
    result.emissiveFactor = [_clamped(value) for value in glow]
    if result.normalTexture is not None and material.normal_scale != 1:
        result.normalTexture.scale = material.normal_scale
    if result.occlusionTexture is not None and material.occlusion_strength != 1:
        result.occlusionTexture.strength = _clamped(material.occlusion_strength)
    if strength > 1:
        key = "KHR_materials_emissive_strength"
        result.extensions[key] = {"emissiveStrength": strength}
    if material.unlit:
        result.extensions["KHR_materials_unlit"] = {}
        return  # the extensions below ask for light
    if material.ior != 1.5:
        # The extension knows 0 and numbers from 1 on.
        ior = max(material.ior, 1.0) if material.ior else 0.0
        result.extensions["KHR_materials_ior"] = {"ior": ior}
    if material.clearcoat > 0:
        result.extensions["KHR_materials_clearcoat"] = {
            "clearcoatFactor": _clamped(material.clearcoat),
            "clearcoatRoughnessFactor": _clamped(material.clearcoat_roughness),
        }


def _joint_texture(
    second: Texture | None, first: Texture | None, role: str, where: str, found: list[Finding]
) -> Texture | None:
    """Return `second` if it can be part of the image of `first`: it must lie the same."""
    if second is None or first is None or second.placed == first.placed:
        return second
    message = "the texture of {role} lies elsewhere than the one glTF packs it with; left out"
    found.append(finding("FEATURE_DROPPED", where, message, role, feature="texture_transform"))
    return None


def _same_channel(one: Texture | None, other: Texture | None, channel: str) -> bool:
    """Return whether `one` is `channel` of the same image as `other`."""
    if one is None or other is None:
        return one is other
    return one.image == other.image and one.channel == channel


def _clamped(value: float) -> float:
    return min(max(float(value), 0.0), 1.0)
