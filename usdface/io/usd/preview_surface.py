"""Inputs of a UsdPreviewSurface and their sources: values, textures, primvars.

Source: OpenUSD, "UsdPreviewSurface Specification" 2.6.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pxr import Sdf, Usd, UsdShade

from usdface.findings import Finding, finding
from usdface.io.usd.attributes import changes
from usdface.io.usd.textures import read_texture, scale_of, value_of
from usdface.materials import Colour, Texture

__all__ = ["Source", "Surface"]


@dataclass(frozen=True, slots=True)
class Source:
    """Source of one input: a value, a channel of a texture shader, or a primvar."""

    value: Any = None
    texture: UsdShade.Shader | None = None
    channel: str = ""
    primvar: str = ""


class Surface:
    """The inputs of one surface, by their names.

    Attributes
    ----------
    findings : list of Finding
        Losses of the inputs that were read so far.
    """

    def __init__(self, shader: UsdShade.Shader, where: str, asset_root: Path | None = None) -> None:
        self._asset_root = asset_root
        self.findings: list[Finding] = []
        self._sources = {
            given.GetBaseName(): _source(given, where, self.findings)
            for given in shader.GetInputs()
        }
        self._images: dict[Sdf.Path, Texture | None] = {}

    def source(self, name: str) -> Source:
        """Return the source of an input; an empty one where there is none."""
        return self._sources.get(name, Source())

    def texture(self, name: str) -> Texture | None:
        """Return the texture of an input, with the channel that it takes."""
        shader, channel = self.source(name).texture, self.source(name).channel
        if shader is None:
            return None
        if shader.GetPath() not in self._images:
            self._images[shader.GetPath()] = read_texture(shader, self.findings, self._asset_root)
        image = self._images[shader.GetPath()]
        return replace(image, channel="" if channel == "rgb" else channel) if image else None

    def colour(self, name: str, default: Colour) -> Colour:
        """Return a colour, or the factor of its texture."""
        shader, value = self.source(name).texture, self.source(name).value
        if shader is not None:
            self._report_bias(shader)
            value = scale_of(shader)
        return default if value is None else (float(value[0]), float(value[1]), float(value[2]))

    def number(self, name: str, default: float) -> float:
        """Return a number, or the factor of the channel of its texture."""
        shader, value = self.source(name).texture, self.source(name).value
        if shader is not None:
            if name != "occlusion":
                self._report_bias(shader)
            return scale_of(shader)[max("rgba".find(self.source(name).channel), 0)]
        return default if value is None else float(value)

    def _report_bias(self, shader: UsdShade.Shader) -> None:
        given = shader.GetInput("bias")
        bias = given.Get() if given else None
        if bias is not None and any(tuple(bias)[:3]):
            message = "glTF has no bias of textures; it is left out"
            self.findings.append(
                finding("FEATURE_DROPPED", str(shader.GetPath()), message, feature="texture_bias")
            )


def _source(given: UsdShade.Input, where: str, found: list[Finding]) -> Source:
    producers = given.GetValueProducingAttributes()
    if not producers:
        return Source()
    if not UsdShade.Output.IsOutput(producers[0]):
        if changes(producers[0]):
            message = "{attribute} changes over time; it stays as it is at the first"
            found.append(finding("ANIMATION_DROPPED", where, message, given.GetBaseName()))
        return Source(producers[0].Get(Usd.TimeCode.EarliestTime()))
    shader = UsdShade.Shader(producers[0].GetPrim())
    kind = str(shader.GetShaderId())
    if kind == "UsdUVTexture":
        return Source(None, shader, UsdShade.Output(producers[0]).GetBaseName())
    if kind.startswith("UsdPrimvarReader_") and given.GetBaseName() in ("diffuseColor", "opacity"):
        primvar = str(value_of(shader, "varname"))
        if primvar in ("displayColor", "displayOpacity"):
            fallback = value_of(shader, "fallback")
            return Source(fallback, primvar=primvar)
    message = "{attribute} comes from a shader node that is not kept"
    name = given.GetBaseName()
    found.append(finding("FEATURE_DROPPED", where, message, name, feature="shader_node"))
    return Source()
