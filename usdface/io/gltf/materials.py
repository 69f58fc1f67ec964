"""Materials of glTF as `usdface.materials.Material`.

Source: glTF 2.0 specification, section 3.9; KHR_materials_emissive_strength, _ior, _unlit and
_clearcoat.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pygltflib

from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.gltf.document import GltfFile
from usdface.io.gltf.extras import read_extras
from usdface.io.gltf.image_kind import has_alpha
from usdface.io.gltf.textures import read_texture
from usdface.materials import AlphaMode, ColourSpace, Material, Texture

__all__ = ["read_materials"]

_MODES: dict[str | None, AlphaMode] = {"MASK": "mask", "BLEND": "blend"}
_HELD = {
    "KHR_materials_emissive_strength": {"emissiveStrength"},
    "KHR_materials_ior": {"ior"},
    "KHR_materials_unlit": set[str](),
    "KHR_materials_clearcoat": {"clearcoatFactor", "clearcoatRoughnessFactor"},
}


def read_materials(
    file: GltfFile, names: tuple[str, ...], uv_names: Sequence[str] = ()
) -> tuple[tuple[Material, ...], list[Finding]]:
    """Return the materials of a file under the given unique `names`.

    `uv_names` are the names of TEXCOORD_0, TEXCOORD_1, ...

    Raises
    ------
    InputError
        If a texture or image does not exist, or its data lie outside the file.
    """
    found: list[Finding] = []
    coloured = {
        primitive.material
        for mesh in file.document.meshes or []
        for primitive in mesh.primitives or []
        if getattr(primitive.attributes, "COLOR_0", None) is not None
    }
    decoded: dict[int, Texture] = {}
    materials = [
        replace(
            _read(file, source, name, uv_names, decoded, found), vertex_colours=number in coloured
        )
        for number, (source, name) in enumerate(
            zip(file.document.materials or [], names, strict=True)
        )
    ]
    return tuple(materials), found


def _read(
    file: GltfFile,
    source: pygltflib.Material,
    name: str,
    uv_names: Sequence[str],
    decoded: dict[int, Texture],
    found: list[Finding],
) -> Material:
    where = f"material {name}"

    def texture(info: Any, space: ColourSpace, channel: str = "") -> Texture | None:
        if info is None:
            return None
        image, new_findings = read_texture(file, info, uv_names, where, decoded)
        found.extend(new_findings)
        return replace(image, space=space, channel=channel) if image else None

    pbr = source.pbrMetallicRoughness or pygltflib.PbrMetallicRoughness()
    base = _numbers(pbr.baseColorFactor, 4, name) or (1.0,) * 4
    emissive = _numbers(source.emissiveFactor, 3, name) or (0.0,) * 3
    extensions = _extensions(source, name, found)
    strength = _number(extensions.get("KHR_materials_emissive_strength"), "emissiveStrength", 1.0)
    coat = extensions.get("KHR_materials_clearcoat")
    mode = _MODES.get(source.alphaMode, "opaque")
    colours = texture(pbr.baseColorTexture, "sRGB")
    alpha = colours if mode != "opaque" and colours is not None and _has_alpha(colours) else None
    packed = pbr.metallicRoughnessTexture
    normal, occlusion = source.normalTexture, source.occlusionTexture
    occlusion_strength = (
        1.0 if occlusion is None or occlusion.strength is None else occlusion.strength
    )
    rough = texture(packed, "raw", "g")
    extras, new_findings = read_extras(source.extras, where=where)
    found += new_findings
    return Material(
        name=name,
        base_color=(base[0], base[1], base[2]),
        opacity=1.0 if mode == "opaque" else base[3],
        metallic=1.0 if pbr.metallicFactor is None else pbr.metallicFactor,
        roughness=1.0 if pbr.roughnessFactor is None else pbr.roughnessFactor,
        emissive=(emissive[0] * strength, emissive[1] * strength, emissive[2] * strength),
        double_sided=bool(source.doubleSided),
        alpha_mode=mode,
        alpha_cutoff=0.5 if source.alphaCutoff is None else source.alphaCutoff,
        # An index of 0 means full reflection at every angle, as of a metal.
        ior=_number(extensions.get("KHR_materials_ior"), "ior", 1.5),
        clearcoat=_number(coat, "clearcoatFactor", 0.0),
        clearcoat_roughness=_number(
            coat, "clearcoatRoughnessFactor", Material("").clearcoat_roughness
        ),
        normal_scale=1.0 if normal is None or normal.scale is None else normal.scale,
        occlusion_strength=occlusion_strength,
        unlit="KHR_materials_unlit" in extensions,
        base_color_texture=colours,
        opacity_texture=replace(alpha, channel="a") if alpha else None,
        metallic_texture=replace(rough, channel="b") if rough else None,
        roughness_texture=rough,
        normal_texture=texture(normal, "raw"),
        occlusion_texture=texture(occlusion, "raw", "r"),
        emissive_texture=texture(source.emissiveTexture, "sRGB"),
        extras=extras,
    )


def _extensions(
    source: pygltflib.Material, name: str, found: list[Finding]
) -> dict[str, dict[str, Any]]:
    """Return the extensions that a material holds; announce the others."""
    kept = {}
    for key, values in (source.extensions or {}).items():
        held = _HELD.get(key)
        left = [key] if held is None else [f"{k} of {key}" for k in sorted({*values} - held)]
        for feature in left:
            where = f"material {name}"
            found.append(finding("FEATURE_DROPPED", where, "{feature} is left out", feature))
        if held is not None:
            kept[key] = values
    return kept


def _has_alpha(texture: Texture) -> bool:
    data = texture.data
    return has_alpha(Path(texture.path).read_bytes() if data is None else data)


def _number(values: dict[str, Any] | None, key: str, default: float) -> float:
    value = (values or {}).get(key, default)
    if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
        raise InputError(f"{key} of a material is {value!r}; expected a number")
    return float(value)


def _numbers(values: Any, count: int, name: str) -> tuple[float, ...] | None:
    if values is None:
        return None
    if len(values) != count or not all(isinstance(v, int | float) for v in values):
        raise InputError(f"a factor of material {name!r} does not have {count} numbers")
    return tuple(values)
