"""Textures of a USD stage: UsdUVTexture, what it is read with and where its image lies.

Source: OpenUSD, "UsdPreviewSurface Specification" 2.6 (UsdUVTexture, UsdTransform2d, primvar
readers, UDIM).
"""

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Ar, Sdf, Usd, UsdShade

from usdface.findings import Finding, finding
from usdface.io.usd.conversion_metadata import our_notes
from usdface.materials import ColourSpace, Placement, Texture, Wrap

__all__ = ["read_texture", "scale_of", "value_of"]

_LARGEST_TEXTURE = 256 * 1024 * 1024
_SPACES: dict[str, ColourSpace] = {"sRGB": "sRGB", "raw": "raw"}
_WRAPS: dict[str, Wrap] = {"repeat": "repeat", "mirror": "mirror", "clamp": "clamp"}


def value_of(shader: UsdShade.Shader, name: str) -> Any:
    """Return the value of a shader's input, maybe of what it is connected to; None for none."""
    given = shader.GetInput(name)
    producers = given.GetValueProducingAttributes() if given else []
    return producers[0].Get() if producers else None


def scale_of(shader: UsdShade.Shader) -> tuple[float, ...]:
    """Return what a UsdUVTexture multiplies its four channels by."""
    value = value_of(shader, "scale")
    return (1.0, 1.0, 1.0, 1.0) if value is None else tuple(float(v) for v in value)


def read_texture(shader: UsdShade.Shader, found: list[Finding]) -> Texture | None:
    """Return the image and placement of a UsdUVTexture; None, with a finding, for no image."""
    where = str(shader.GetPath())

    def missing(why: str) -> Texture | None:
        found.append(finding("TEXTURE_MISSING", where, f"{why}; the texture is left out"))
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
    outer, inner = Ar.SplitPackageRelativePathOuter(resolved)
    if not any(Path(outer).resolve().is_relative_to(folder) for folder in _folders(attribute)):
        return missing(f"{asset.path} is outside the folder of the file that names it")
    space = _SPACES.get(str(value_of(shader, "sourceColorSpace")), "auto")
    placed = _placement(shader, where, found)
    if not inner:
        return Texture(outer, None, Path(outer).suffix, space=space, placed=placed)
    if tiled:
        return missing(f"{asset.path} is a UDIM inside a package")
    try:
        with zipfile.ZipFile(outer) as package:
            if package.getinfo(inner).file_size > _LARGEST_TEXTURE:
                return missing(f"{inner} is larger than {_LARGEST_TEXTURE >> 20} MiB")
            data = package.read(inner)
    except (OSError, KeyError, zipfile.BadZipFile) as error:
        return missing(f"{asset.path} cannot be read from its package ({error})")
    return Texture("", data, Path(inner).suffix, space=space, placed=placed)


def _folders(attribute: Usd.Attribute) -> list[Path]:
    """Return the folders that textures may come from: the naming and the root layers'."""
    layers = [spec.layer for spec in attribute.GetPropertyStack(Usd.TimeCode.Default())]
    layers.append(attribute.GetStage().GetRootLayer())
    paths = [Ar.SplitPackageRelativePathOuter(layer.realPath)[0] for layer in layers]
    return [Path(path).resolve().parent for path in paths if path]


def _placement(shader: UsdShade.Shader, where: str, found: list[Finding]) -> Placement:
    wraps: list[Wrap] = []
    for name in ("wrapS", "wrapT"):
        given = str(value_of(shader, name) or "useMetadata")
        if given == "black":
            message = "glTF does not know black beyond the edges of a texture; they are clamped"
            found.append(finding("FEATURE_APPROXIMATED", where, message))
        wraps.append("clamp" if given == "black" else _WRAPS.get(given, "repeat"))
    notes = our_notes(shader)
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
        message = f"texture coordinates come from {reader.GetShaderId()}; those of the mesh serve"
        found.append(finding("FEATURE_APPROXIMATED", where, message))
    return Placement(uv, (wraps[0], wraps[1]), (filters[0], filters[1]), scale, rotation, offset)


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
