"""Textures of a USD stage: UsdUVTexture, its primvar and transform, and its image.

Source: OpenUSD, "UsdPreviewSurface Specification" 2.6 (UsdUVTexture, UsdTransform2d, primvar
readers, UDIM).
"""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Ar, Sdf, Usd, UsdShade

from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.findings.values import Prose
from usdface.io.asset_folder import OUTSIDE, is_inside
from usdface.io.udim import udim_tiles
from usdface.io.usd.assets import folders_of, outer_file, read_asset
from usdface.io.usd.attributes import changes
from usdface.io.usd.conversion_metadata import read_metadata
from usdface.io.usd.held_layers import hold
from usdface.materials import ColourSpace, Placement, Texture, Wrap

__all__ = ["read_texture", "scale_of", "value_of"]

_SPACES: dict[str, ColourSpace] = {"sRGB": "sRGB", "raw": "raw"}
_WRAPS: dict[str, Wrap] = {"repeat": "repeat", "mirror": "mirror", "clamp": "clamp"}


def value_of(shader: UsdShade.Shader, name: str) -> Any:
    """Return the value of a shader's input or of its connection; None where there is none."""
    given = shader.GetInput(name)
    producers = given.GetValueProducingAttributes() if given else []
    return producers[0].Get(Usd.TimeCode.EarliestTime()) if producers else None


def scale_of(shader: UsdShade.Shader) -> tuple[float, ...]:
    """Return the scale of the four channels of a UsdUVTexture."""
    value = value_of(shader, "scale")
    return (1.0, 1.0, 1.0, 1.0) if value is None else tuple(float(v) for v in value)


def read_texture(
    shader: UsdShade.Shader, found: list[Finding], asset_root: Path | None
) -> Texture | None:
    """Return the image and placement of a UsdUVTexture; None, with a finding, for no image.

    An image must lie in the folder of the layer that names it, of the stage's root layer, or in
    `asset_root`; one that a package names in that package.
    """
    where = str(shader.GetPath())

    def missing(why: str, code: str = "TEXTURE_MISSING") -> Texture | None:
        found.append(finding(code, where, "{why}; the texture is left out", Prose(why)))
        return None

    asset = value_of(shader, "file")
    if not isinstance(asset, Sdf.AssetPath) or not asset.path:
        return missing("it names no file")
    attribute = shader.GetInput("file").GetValueProducingAttributes()[0]
    resolved = asset.resolvedPath
    tiled = UsdShade.UdimUtils.IsUdimIdentifier(asset.path)
    if tiled:
        layer = attribute.GetPropertyStack(Usd.TimeCode.Default())[0].layer
        resolved = UsdShade.UdimUtils.ResolveUdimPath(asset.path, layer)
    if not resolved:
        return missing(f"{asset.path} does not exist")
    inner = Ar.SplitPackageRelativePathOuter(resolved)[1]
    if inner and tiled:
        return missing(f"{asset.path} is a UDIM inside a package")
    outer = outer_file(resolved)
    name = str(read_metadata(shader).get("imageName", ""))
    texture = Texture(str(outer), None, outer.suffix, image_name=name)
    files = [Path(tile.path) for tile in udim_tiles(texture).values()] if tiled else [outer]
    folders = [*_folders(attribute), asset_root]
    if not all(is_inside(file, folders) for file in files):
        return missing(f"{asset.path} {OUTSIDE}", "ASSET_OUTSIDE")
    if changing := _changing_inputs(shader):
        message = "they change over time, and stay as at the first: {channels}"
        found.append(finding("ANIMATION_DROPPED", where, message, changing))
    space = _SPACES.get(str(value_of(shader, "sourceColorSpace")), "auto")
    placed = _placement(shader, where, found)
    if not inner:
        return replace(texture, space=space, placed=placed)
    try:
        data = read_asset(resolved)
    except InputError as error:
        return missing(str(error))
    return replace(
        texture, path="", data=data, suffix=Path(inner).suffix, space=space, placed=placed
    )


def _changing_inputs(shader: UsdShade.Shader) -> list[str]:
    """Return the inputs of a texture, and of its transforms on the mesh, that change."""
    parts, mover = [shader], _upstream(shader, "st")
    if mover is not None and mover.GetShaderId() == "UsdTransform2d":
        parts.append(mover)
    found: list[str] = []
    for part in parts:
        for given in part.GetInputs():
            producers = given.GetValueProducingAttributes()
            plain = producers and not UsdShade.Output.IsOutput(producers[0])
            if plain and changes(producers[0]):
                found.append(given.GetBaseName())
    return sorted(found)


def _folders(attribute: Usd.Attribute) -> list[Path]:
    """Return the folders of the layer that gives an attribute its value, and of the root layer."""
    specs = attribute.GetPropertyStack(Usd.TimeCode.Default())
    hold(specs)
    naming = next((spec.layer for spec in specs if spec.HasDefaultValue()), None)
    return [
        *(folders_of(naming) if naming else ()),
        *folders_of(attribute.GetStage().GetRootLayer())[:1],
    ]


def _placement(shader: UsdShade.Shader, where: str, found: list[Finding]) -> Placement:
    wraps: list[Wrap] = []
    for name in ("wrapS", "wrapT"):
        given = str(value_of(shader, name) or "useMetadata")
        if given == "black":
            message = "glTF does not know black beyond the edges of a texture; they are clamped"
            found.append(finding("FEATURE_APPROXIMATED", where, message, feature="texture_wrap"))
        wraps.append("clamp" if given == "black" else _WRAPS.get(given, "repeat"))
    notes = read_metadata(shader)
    filters = tuple(n if isinstance(n := notes.get(k), int) else 0 for k in _FILTERS)
    reader = _upstream(shader, "st")
    scale, rotation, offset = (1.0, 1.0), 0.0, (0.0, 0.0)
    if reader is not None and reader.GetShaderId() == "UsdTransform2d":
        scale = _pair(value_of(reader, "scale"), scale)
        rotation = float(np.deg2rad(float(value_of(reader, "rotation") or 0.0)))
        offset = _pair(value_of(reader, "translation"), offset)
        reader = _upstream(reader, "in")
    uv = "st"
    if reader is not None and str(reader.GetShaderId()).startswith("UsdPrimvarReader_float2"):
        uv = str(value_of(reader, "varname") or uv)
    elif reader is not None:
        message = "texture coordinates come from {shader}; those of the mesh serve"
        found.append(
            finding(
                "FEATURE_APPROXIMATED",
                where,
                message,
                str(reader.GetShaderId()),
                feature="texture_coordinates",
            )
        )
    name, sides = str(notes.get("textureName", "")), (wraps[0], wraps[1])
    return Placement(uv, sides, (filters[0], filters[1]), scale, rotation, offset, name)


_FILTERS = ("magFilter", "minFilter")


def _pair(value: Any, default: tuple[float, float]) -> tuple[float, float]:
    return default if value is None else (float(value[0]), float(value[1]))


def _upstream(shader: UsdShade.Shader, name: str) -> UsdShade.Shader | None:
    """Return the shader that drives an input, through node graphs."""
    given = shader.GetInput(name)
    producers = given.GetValueProducingAttributes() if given else []
    if not producers or not UsdShade.Output.IsOutput(producers[0]):
        return None
    return UsdShade.Shader(producers[0].GetPrim())
