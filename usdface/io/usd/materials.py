"""Materials of a USD stage: the simple part of UsdPreviewSurface."""

import itertools
import zipfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pxr import Ar, Sdf, Usd, UsdGeom, UsdShade

from usdface.findings import Finding, finding
from usdface.rigs import Material, MaterialSubset, Mesh, Texture

__all__ = ["with_materials"]

_LARGEST_TEXTURE = 256 * 1024 * 1024


@dataclass(frozen=True, slots=True)
class _Source:
    """What drives one input of a surface: a value, or a channel of a texture shader."""

    value: Any = None
    texture: UsdShade.Shader | None = None
    channel: str = ""


def with_materials(
    stage: Usd.Stage, meshes: tuple[Mesh, ...]
) -> tuple[tuple[Mesh, ...], tuple[Material, ...], list[Finding]]:
    """Read the materials that `meshes` name by prim path, and name them by their own names.

    A texture must lie in the folder of the layer that names it or of the stage's root layer
    (or inside the same package); elsewhere it is left out with a finding.
    """
    paths = [path for mesh in meshes for path in _bound(mesh) if path]
    names = {"": ""}
    materials: list[Material] = []
    findings: list[Finding] = []
    for path in dict.fromkeys(paths):
        prim = stage.GetPrimAtPath(path)
        wanted = prim.GetDisplayName() or prim.GetName()
        suffixes = itertools.chain([""], (f"_{n}" for n in itertools.count(1)))
        names[path] = next(wanted + s for s in suffixes if wanted + s not in names.values())
        if names[path] != wanted:
            findings.append(finding("NAME_CHANGED", path, f"{wanted!r} is now {names[path]!r}"))
        material, notes = _read_material(UsdShade.Material(prim), names[path])
        sided = any(path in _bound(m) and _is_double_sided(stage, m) for m in meshes)
        materials.append(replace(material, double_sided=sided))
        findings += notes
    named = tuple(
        replace(
            mesh,
            material=names[mesh.material],
            subsets=tuple(MaterialSubset(names[s.material], s.faces) for s in mesh.subsets),
        )
        for mesh in meshes
    )
    return named, tuple(materials), findings


def _bound(mesh: Mesh) -> tuple[str, ...]:
    return (mesh.material, *(subset.material for subset in mesh.subsets))


def _is_double_sided(stage: Usd.Stage, mesh: Mesh) -> bool:
    return bool(UsdGeom.Mesh(stage.GetPrimAtPath(mesh.path)).GetDoubleSidedAttr().Get())


def _read_material(material: UsdShade.Material, name: str) -> tuple[Material, list[Finding]]:
    where = str(material.GetPath())
    surface = material.ComputeSurfaceSource()[0]
    if not surface or surface.GetShaderId() != "UsdPreviewSurface":
        message = "the material is not a UsdPreviewSurface; a grey one stands for it"
        return Material(name), [finding("FEATURE_DROPPED", where, message)]
    findings: list[Finding] = []
    sources = {
        given.GetBaseName(): _source(given, where, findings) for given in surface.GetInputs()
    }

    def texture(role: str) -> Texture | None:
        shader = sources.get(role, _Source()).texture
        return _texture(shader, findings) if shader else None

    def color(role: str, default: tuple[float, float, float]) -> tuple[float, float, float]:
        source = sources.get(role, _Source())
        value = _scale(source.texture) if source.texture else source.value
        return default if value is None else (float(value[0]), float(value[1]), float(value[2]))

    def number(role: str, default: float, channel: str) -> float:
        source = sources.get(role, _Source())
        if source.texture and source.channel == channel:
            return _scale(source.texture)["rgb".index(channel)]
        if source.texture:
            findings.append(finding("FEATURE_DROPPED", where, f"the texture of {role} is not kept"))
            return default
        return default if source.value is None else float(source.value)

    rough, metal = sources.get("roughness", _Source()), sources.get("metallic", _Source())
    packed = rough.texture and metal.texture and _file(rough.texture) == _file(metal.texture)
    result = Material(
        name,
        color("diffuseColor", Material("").base_color),
        number("opacity", 1.0, "-"),
        number("metallic", 0.0, "b" if packed else "-"),
        number("roughness", 0.5, "g" if packed else "-"),
        color("emissiveColor", Material("").emissive),
        base_color_texture=texture("diffuseColor"),
        normal_texture=texture("normal"),
        metallic_roughness_texture=texture("roughness") if packed else None,
        occlusion_texture=texture("occlusion"),
        emissive_texture=texture("emissiveColor"),
    )
    return result, findings


def _source(given: UsdShade.Input, where: str, findings: list[Finding]) -> _Source:
    producers = given.GetValueProducingAttributes()
    if not producers:
        return _Source()
    if not UsdShade.Output.IsOutput(producers[0]):
        return _Source(producers[0].Get())
    shader = UsdShade.Shader(producers[0].GetPrim())
    if shader.GetShaderId() == "UsdUVTexture":
        return _Source(None, shader, UsdShade.Output(producers[0]).GetBaseName())
    message = f"{given.GetBaseName()} comes from a shader node that is not kept"
    findings.append(finding("FEATURE_DROPPED", where, message))
    return _Source()


def _scale(shader: UsdShade.Shader) -> tuple[float, ...]:
    given = shader.GetInput("scale")
    value = given.Get() if given else None
    return (1.0, 1.0, 1.0, 1.0) if value is None else tuple(float(v) for v in value)


def _file(shader: UsdShade.Shader) -> Sdf.AssetPath | None:
    given = shader.GetInput("file")
    producers = given.GetValueProducingAttributes() if given else []
    value = producers[0].Get() if producers else None
    return value if isinstance(value, Sdf.AssetPath) else None


def _texture(shader: UsdShade.Shader, findings: list[Finding]) -> Texture | None:
    where = str(shader.GetPath())

    def missing(why: str) -> Texture | None:
        findings.append(finding("TEXTURE_MISSING", where, f"{why}; the texture is left out"))
        return None

    asset = _file(shader)
    if asset is None or not asset.path:
        return missing("it names no file")
    if not asset.resolvedPath:
        return missing(f"{asset.path} does not exist")
    outer, inner = Ar.SplitPackageRelativePathOuter(asset.resolvedPath)
    attribute = shader.GetInput("file").GetValueProducingAttributes()[0]
    if not any(Path(outer).resolve().is_relative_to(folder) for folder in _folders(attribute)):
        return missing(f"{asset.path} is outside the folder of the file that names it")
    if not inner:
        return Texture(outer, None, Path(outer).suffix)
    try:
        with zipfile.ZipFile(outer) as package:
            if package.getinfo(inner).file_size > _LARGEST_TEXTURE:
                return missing(f"{inner} is larger than {_LARGEST_TEXTURE >> 20} MiB")
            return Texture("", package.read(inner), Path(inner).suffix)
    except (OSError, KeyError, zipfile.BadZipFile) as error:
        return missing(f"{asset.path} cannot be read from its package ({error})")


def _folders(attribute: Usd.Attribute) -> list[Path]:
    """Return the folders that textures may come from: the naming and the root layers'."""
    layers = [spec.layer for spec in attribute.GetPropertyStack(Usd.TimeCode.Default())]
    layers.append(attribute.GetStage().GetRootLayer())
    paths = [Ar.SplitPackageRelativePathOuter(layer.realPath)[0] for layer in layers]
    return [Path(path).resolve().parent for path in paths if path]
