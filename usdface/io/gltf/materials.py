"""Materials of glTF: the metallic-roughness part that `usdface.rigs.Material` holds, in and out.

As in glTF, a rig's values multiply their textures.

Source: glTF 2.0 specification, section 3.9.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote, unquote

import pygltflib

from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.gltf.accessors import BufferBuilder
from usdface.io.gltf.document import GltfFile, item, resource
from usdface.io.gltf.image import has_alpha, image_type, to_gltf_image
from usdface.rigs import Material, Texture

__all__ = ["WrittenMaterials", "read_materials", "write_materials"]

_SUFFIXES = {"image/png": ".png", "image/jpeg": ".jpg"}
_COLOUR_SLOTS = ("base_color_texture", "emissive_texture")


# -- in ------------------------------------------------------------------------------------


def read_materials(
    file: GltfFile, names: tuple[str, ...]
) -> tuple[tuple[Material, ...], list[Finding]]:
    """Return the materials of a file under the given unique `names`.

    Embedded images come as bytes, images beside the file as its path.

    Raises
    ------
    InputError
        If a texture or image does not exist, or its data lie outside the file.
    """
    found: list[Finding] = []
    materials = [
        _read(file, source, name, found)
        for source, name in zip(file.document.materials or [], names, strict=True)
    ]
    return tuple(materials), found


def _read(file: GltfFile, source: pygltflib.Material, name: str, found: list[Finding]) -> Material:
    def lost(what: str) -> None:
        found.append(finding("FEATURE_DROPPED", f"material {name}", f"{what} is left out"))

    def texture(info: Any, what: str, plain: bool = True) -> Texture | None:
        if info is None:
            return None
        if info.texCoord or info.extensions:
            lost(f"the second texture coordinate or transform of the {what} texture")
        if not plain:
            lost(f"the strength of the {what} texture")
        image, missing = _image(file, info.index)
        if missing:
            found.append(finding("TEXTURE_MISSING", f"material {name}", missing))
        return image

    pbr = source.pbrMetallicRoughness or pygltflib.PbrMetallicRoughness()
    base = _numbers(pbr.baseColorFactor, 4, name) or (1.0,) * 4
    metallic = 1.0 if pbr.metallicFactor is None else pbr.metallicFactor
    roughness = 1.0 if pbr.roughnessFactor is None else pbr.roughnessFactor
    emissive = _numbers(source.emissiveFactor, 3, name) or (0.0,) * 3
    normal, occlusion = source.normalTexture, source.occlusionTexture
    opaque = source.alphaMode in (None, "OPAQUE")
    colours = texture(pbr.baseColorTexture, "base colour")
    if not opaque and colours is not None and _has_alpha(colours):
        lost("the alpha of the base colour texture")
    for extension in source.extensions or {}:
        lost(f"the extension {extension}")
    return Material(
        name,
        (base[0], base[1], base[2]),
        1.0 if opaque else base[3],
        metallic,
        roughness,
        (emissive[0], emissive[1], emissive[2]),
        bool(source.doubleSided),
        colours,
        texture(normal, "normal", normal is None or normal.scale in (None, 1)),
        texture(pbr.metallicRoughnessTexture, "roughness"),
        texture(occlusion, "occlusion", occlusion is None or occlusion.strength in (None, 1)),
        texture(source.emissiveTexture, "emissive"),
    )


def _has_alpha(texture: Texture) -> bool:
    data = texture.data
    return has_alpha(Path(texture.path).read_bytes() if data is None else data)


def _numbers(values: Any, count: int, name: str) -> tuple[float, ...] | None:
    if values is None:
        return None
    if len(values) != count or not all(isinstance(v, int | float) for v in values):
        raise InputError(f"a factor of material {name!r} does not have {count} numbers")
    return tuple(values)


def _image(file: GltfFile, index: object) -> tuple[Texture | None, str]:
    """Return a texture's image, or why there is none."""
    texture = item(file.document.textures or [], index, "texture")
    if texture.source is None:
        return None, "its image is in a format that only an extension defines"
    image = item(file.document.images or [], texture.source, "image")
    if image.bufferView is not None:
        view = item(file.document.bufferViews or [], image.bufferView, "bufferView")
        buffer = item(file.buffers, view.buffer, "buffer")
        start, length = view.byteOffset or 0, view.byteLength or 0
        if start < 0 or length < 0 or start + length > len(buffer):
            raise InputError(f"bufferView {image.bufferView} reaches beyond its buffer")
        data = buffer[start : start + length]
    elif image.uri is None:
        return None, f"image {texture.source} has neither a URI nor data"
    else:
        try:
            data = resource(image.uri, file.folder)
        except InputError as error:
            return None, str(error)
        if not image.uri.startswith("data:"):
            place = file.folder / unquote(image.uri)
            return Texture(path=str(place), suffix=place.suffix), ""
    return Texture(data=data, suffix=_SUFFIXES.get(image_type(data), "")), ""


# -- out -----------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False, slots=True)
class WrittenMaterials:
    """Materials, textures and images of a document, and the files that belong beside it."""

    materials: tuple[pygltflib.Material, ...]
    textures: tuple[pygltflib.Texture, ...]
    images: tuple[pygltflib.Image, ...]
    beside: Mapping[str, bytes]


def write_materials(
    materials: Iterable[Material], builder: BufferBuilder, path: Path
) -> tuple[WrittenMaterials, list[Finding]]:
    """Return materials for a document at `path`: images go into a GLB, beside a .gltf.

    An image that several materials use is stored once. Values outside [0, 1] are clamped.
    """
    found: list[Finding] = []
    images: dict[tuple[bytes, str], int] = {}
    known: dict[tuple[Texture, bool], int | None] = {}

    def index_of(texture: Texture | None, slot: str) -> int | None:
        if texture is None:
            return None
        key = (texture, slot in _COLOUR_SLOTS)
        if key not in known:
            image, news = to_gltf_image(*key)
            found.extend(news)
            known[key] = None if image is None else images.setdefault(image, len(images))
        return known[key]

    written = tuple(_written(material, index_of, found) for material in materials)
    stored, beside = [], {}
    for number, (data, mime) in enumerate(images):
        if path.suffix.lower() == ".glb":
            stored.append(pygltflib.Image(mimeType=mime, bufferView=builder.view(data)))
        else:
            name = f"{path.stem}_textures/{number}{_SUFFIXES[mime]}"
            beside[name] = data
            stored.append(pygltflib.Image(uri=quote(name)))
    textures = tuple(pygltflib.Texture(source=number) for number in range(len(stored)))
    return WrittenMaterials(written, textures, tuple(stored), beside), found


def _written(material: Material, index_of: Any, found: list[Finding]) -> pygltflib.Material:
    def info(kind: Any, slot: str) -> Any:
        index = index_of(getattr(material, slot), slot)
        return None if index is None else kind(index=index)

    values = [*material.base_color, material.opacity, *material.emissive]
    values += [material.metallic, material.roughness]
    if not all(0 <= value <= 1 for value in values):
        message = "a value outside 0 to 1 is clamped"
        found.append(finding("FEATURE_DROPPED", f"material {material.name}", message))
    return pygltflib.Material(
        name=material.name,
        pbrMetallicRoughness=pygltflib.PbrMetallicRoughness(
            baseColorFactor=[_clamped(v) for v in (*material.base_color, material.opacity)],
            metallicFactor=_clamped(material.metallic),
            roughnessFactor=_clamped(material.roughness),
            baseColorTexture=info(pygltflib.TextureInfo, "base_color_texture"),
            metallicRoughnessTexture=info(pygltflib.TextureInfo, "metallic_roughness_texture"),
        ),
        normalTexture=info(pygltflib.NormalMaterialTexture, "normal_texture"),
        occlusionTexture=info(pygltflib.OcclusionTextureInfo, "occlusion_texture"),
        emissiveTexture=info(pygltflib.TextureInfo, "emissive_texture"),
        emissiveFactor=[_clamped(v) for v in material.emissive],
        alphaMode="OPAQUE" if material.opacity >= 1 else "BLEND",
        doubleSided=material.double_sided,
    )


def _clamped(value: float) -> float:
    return min(max(float(value), 0.0), 1.0)
