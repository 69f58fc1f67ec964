"""Materials to USD: UsdPreviewSurface with textures beside the file."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

from pxr import Gf, Sdf, Usd, UsdShade

from usdface.findings import Finding, finding
from usdface.io.inputs import among
from usdface.io.prim_names import prim_names
from usdface.io.udim import texture_files
from usdface.io.usd.conversion_metadata import write_metadata
from usdface.io.usd.extras import write_extras
from usdface.io.usd.texture_files import TextureFiles
from usdface.materials import Material, Texture

__all__ = ["write_materials"]

_FLOAT = Sdf.ValueTypeNames.Float
_FLOAT2, _FLOAT3 = Sdf.ValueTypeNames.Float2, Sdf.ValueTypeNames.Float3
_COLOR = Sdf.ValueTypeNames.Color3f
_KINDS = {"diffuseColor": _COLOR, "emissiveColor": _COLOR, "normal": Sdf.ValueTypeNames.Normal3f}


@dataclass(frozen=True, slots=True)
class _Node:
    """One texture shader: the inputs of the surface that it drives, each by a channel."""

    role: str
    texture: Texture
    inputs: list[tuple[str, str]]
    scale: tuple[float, ...]
    bias: tuple[float, ...] | None = None


def write_materials(
    stage: Usd.Stage,
    scope: str,
    materials: tuple[Material, ...],
    target: Path,
    read: Iterable[Path],
) -> tuple[dict[str, UsdShade.Material], list[Finding]]:
    """Define `materials` below the prim path `scope`; return them by original name.

    Textures inside the folder of `target` (the file that the stage will be saved to) are
    referenced relative to it; others, and those held as bytes, are copied to
    `<stem>_textures` beside it, so that the result can be moved as one. None of them replaces one
    of the materials' own files, or of those that were `read`.

    Raises
    ------
    OutputError
        If a texture cannot be written.
    """
    findings: list[Finding] = []
    files = TextureFiles(target, findings, among([*read, *texture_files(materials)]))
    made: dict[str, UsdShade.Material] = {}
    for name, material in zip(prim_names(m.name for m in materials), materials, strict=True):
        prim = UsdShade.Material.Define(stage, f"{scope}/{name}")
        if name != material.name:
            prim.GetPrim().SetDisplayName(material.name)
            findings.append(
                finding("NAME_CHANGED", str(prim.GetPath()), "was {original!r}", material.name)
            )
        _write_surface(prim, material, files, findings)
        findings += write_extras(prim.GetPrim(), material.extras)
        made.setdefault(material.name, prim)
    return made, findings


def _write_surface(
    prim: UsdShade.Material, material: Material, files: TextureFiles, found: list[Finding]
) -> None:
    stage, path = prim.GetPrim().GetStage(), prim.GetPath()
    surface = UsdShade.Shader.Define(stage, path.AppendChild("Surface"))
    surface.CreateIdAttr("UsdPreviewSurface")
    prim.CreateSurfaceOutput().ConnectToSource(
        surface.CreateOutput("surface", Sdf.ValueTypeNames.Token)
    )
    shown, glow = ("emissiveColor", "") if material.unlit else ("diffuseColor", "emissiveColor")
    for name, (kind, value) in _surface_values(material, shown).items():
        surface.CreateInput(name, kind).Set(value)
    _write_approximations(prim.GetPrim(), material, found)
    for node in _nodes(material, shown, glow):
        asset = files.asset(node.texture, f"{path.name}_{node.role}")
        if asset:
            reader = _texture_reader(prim, node, asset)
            for name, channel in node.inputs:
                kind = _KINDS.get(name, _FLOAT)
                output = _FLOAT if len(channel) == 1 else Sdf.ValueTypeNames.Float3
                surface.CreateInput(name, kind).ConnectToSource(
                    reader.CreateOutput(channel, output)
                )
    if material.vertex_colours:
        _write_vertex_colours(prim, surface, material, found)


def _surface_values(material: Material, shown: str) -> dict[str, tuple[Sdf.ValueTypeName, object]]:
    """Return the values of a surface's inputs, by name; `shown` has the base colour."""
    values: dict[str, tuple[Sdf.ValueTypeName, object]] = {
        "diffuseColor": (_COLOR, Gf.Vec3f(0.0)),
        "emissiveColor": (_COLOR, Gf.Vec3f(*material.emissive)),
        shown: (_COLOR, Gf.Vec3f(*material.base_color)),
        "metallic": (_FLOAT, material.metallic),
        "roughness": (_FLOAT, material.roughness),
        "opacity": (_FLOAT, material.opacity),
    }
    standard = Material("")
    if material.ior != standard.ior:
        values["ior"] = (_FLOAT, material.ior)
    if material.clearcoat != standard.clearcoat:
        values["clearcoat"] = (_FLOAT, material.clearcoat)
        values["clearcoatRoughness"] = (_FLOAT, material.clearcoat_roughness)
    if material.alpha_mode != "opaque":  # coverage, as in glTF, not glass
        values["opacityMode"] = (Sdf.ValueTypeNames.Token, "presence")
    if material.alpha_mode == "mask":
        values["opacityThreshold"] = (_FLOAT, material.alpha_cutoff)
    return values


def _write_approximations(prim: Usd.Prim, material: Material, found: list[Finding]) -> None:
    """Keep properties that the shader cannot show as metadata, and report them."""
    path = str(prim.GetPath())
    if material.unlit:
        write_metadata(prim, "unlit", True)
        message = "unlit is written as a surface that glows and reflects little"
        found.append(finding("FEATURE_APPROXIMATED", path, message, feature="unlit"))
    if material.normal_scale != 1 and material.normal_texture:
        # USD's validators want the scale of a normal map to be 2.
        write_metadata(prim, "normalScale", material.normal_scale)
        message = "the strength of the normal map is kept for glTF only; USD shows all of it"
        found.append(finding("FEATURE_APPROXIMATED", path, message, feature="normal_strength"))


def _nodes(material: Material, shown: str, glow: str) -> list[_Node]:
    """Return the textures that a material reads, each with all that it drives."""
    m, nodes = material, []
    base, seen = m.base_color_texture, m.opacity_texture
    tint = (*m.base_color, m.opacity)
    if base is not None:
        inputs = [(shown, "rgb")]
        if seen is not None and seen == replace(base, channel="a"):
            inputs.append(("opacity", "a"))
            seen = None
        nodes.append(_Node("baseColor", base, inputs, tint))
    if seen is not None:
        nodes.append(_single("opacity", seen, m.opacity))
    rough, metal = m.roughness_texture, m.metallic_texture
    if rough and metal and metal == replace(rough, channel="b") and rough.channel == "g":
        scale = (1.0, m.roughness, m.metallic, 1.0)
        inputs = [("roughness", "g"), ("metallic", "b")]
        nodes.append(_Node("metallicRoughness", rough, inputs, scale))
    else:
        nodes += [_single("roughness", rough, m.roughness)] if rough else []
        nodes += [_single("metallic", metal, m.metallic)] if metal else []
    if m.occlusion_texture:
        node = _single("occlusion", m.occlusion_texture, m.occlusion_strength)
        if m.occlusion_strength != 1:  # 1 + strength * (texture - 1)
            node = replace(node, bias=(1 - m.occlusion_strength,) * 4)
        nodes.append(node)
    if m.normal_texture:  # stored 0 to 1, meant -1 to 1
        scale, bias = (2.0, 2.0, 2.0, 1.0), (-1.0, -1.0, -1.0, 0.0)
        nodes.append(_Node("normal", m.normal_texture, [("normal", "rgb")], scale, bias))
    if m.emissive_texture and glow:
        nodes.append(_Node("emissive", m.emissive_texture, [(glow, "rgb")], (*m.emissive, 1.0)))
    return nodes


def _single(role: str, texture: Texture, value: float) -> _Node:
    return _Node(role, texture, [(role, texture.channel or "r")], (value,) * 4)


def _texture_reader(prim: UsdShade.Material, node: _Node, asset: str) -> UsdShade.Shader:
    stage, path, placed = prim.GetPrim().GetStage(), prim.GetPath(), node.texture.placed
    reader = UsdShade.Shader.Define(stage, path.AppendChild(node.role))
    reader.CreateIdAttr("UsdUVTexture")
    reader.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(Sdf.AssetPath(asset))
    source = _primvar_reader(prim, placed.uv, 2)
    if placed.moved:
        moved = UsdShade.Shader.Define(stage, path.AppendChild(f"{node.role}_transform"))
        moved.CreateIdAttr("UsdTransform2d")
        moved.CreateInput("in", _FLOAT2).ConnectToSource(source)
        moved.CreateInput("scale", _FLOAT2).Set(Gf.Vec2f(*placed.scale))
        moved.CreateInput("rotation", _FLOAT).Set(math.degrees(placed.rotation))
        moved.CreateInput("translation", _FLOAT2).Set(Gf.Vec2f(*placed.offset))
        source = moved.CreateOutput("result", _FLOAT2)
    reader.CreateInput("st", _FLOAT2).ConnectToSource(source)
    for name, wrap in zip(("wrapS", "wrapT"), placed.wrap, strict=True):
        reader.CreateInput(name, Sdf.ValueTypeNames.Token).Set(wrap)
    for key, value in _noted(node.texture).items():
        if value:
            write_metadata(reader.GetPrim(), key, value)
    space = node.texture.space
    if space == "auto":
        space = "sRGB" if node.role in ("baseColor", "emissive") else "raw"
    reader.CreateInput("sourceColorSpace", Sdf.ValueTypeNames.Token).Set(space)
    reader.CreateInput("scale", Sdf.ValueTypeNames.Float4).Set(Gf.Vec4f(*node.scale))
    if node.bias is not None:
        reader.CreateInput("bias", Sdf.ValueTypeNames.Float4).Set(Gf.Vec4f(*node.bias))
    return reader


def _noted(texture: Texture) -> dict[str, int | str]:
    """Return settings of a texture that only glTF has, by the keys of `usdface.io.usd.textures`."""
    placed = texture.placed
    filters = dict(zip(("magFilter", "minFilter"), placed.filters, strict=True))
    return filters | {"textureName": placed.texture_name, "imageName": texture.image_name}


def _primvar_reader(prim: UsdShade.Material, name: str, width: int) -> UsdShade.Output:
    """Return the primvar reader of one to three floats; there is one for each primvar."""
    (legal,) = prim_names([name])
    reader = UsdShade.Shader.Define(
        prim.GetPrim().GetStage(), prim.GetPath().AppendChild(f"{legal}_reader")
    )
    suffix, kind = {1: ("", _FLOAT), 2: ("2", _FLOAT2), 3: ("3", _FLOAT3)}[width]
    reader.CreateIdAttr(f"UsdPrimvarReader_float{suffix}")
    reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set(name)
    return reader.CreateOutput("result", kind)


def _write_vertex_colours(
    prim: UsdShade.Material, surface: UsdShade.Shader, material: Material, found: list[Finding]
) -> None:
    """Let the mesh's displayColor drive the base colour, as far as UsdPreviewSurface can."""
    where = str(prim.GetPath())
    write_metadata(prim.GetPrim(), "vertexColors", True)
    if material.base_color_texture is not None:
        message = "vertex colours do not multiply a texture in UsdPreviewSurface; the texture shows"
        found.append(finding("FEATURE_APPROXIMATED", where, message, feature="vertex_colours"))
        return
    reader = _primvar_reader(prim, "displayColor", 3)
    node = UsdShade.Shader(reader.GetPrim())
    # Fallback of meshes without vertex colours.
    node.CreateInput("fallback", _FLOAT3).Set(Gf.Vec3f(*material.base_color))
    name = "emissiveColor" if material.unlit else "diffuseColor"
    surface.CreateInput(name, _COLOR).ConnectToSource(reader)
    if material.alpha_mode != "opaque" and material.opacity_texture is None:
        reader = _primvar_reader(prim, "displayOpacity", 1)
        node = UsdShade.Shader(reader.GetPrim())
        node.CreateInput("fallback", _FLOAT).Set(material.opacity)
        surface.CreateInput("opacity", _FLOAT).ConnectToSource(reader)
