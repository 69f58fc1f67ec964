"""Materials of a USD stage: UsdPreviewSurface.

Source: OpenUSD, "UsdPreviewSurface Specification" 2.6.
"""

import itertools
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from pxr import Sdf, Usd, UsdGeom, UsdShade

from usdface.findings import Finding, finding
from usdface.io.usd.extras import read_extras
from usdface.io.usd.notes import our_notes
from usdface.io.usd.textures import read_texture, scale_of, value_of
from usdface.materials import AlphaMode, Material, Texture
from usdface.rigs import MaterialSubset, Mesh

__all__ = ["with_materials"]

Colour = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class _Source:
    """What drives one input of a surface: a value, a channel of a texture shader, a primvar."""

    value: Any = None
    texture: UsdShade.Shader | None = None
    channel: str = ""
    primvar: str = ""


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
    found: list[Finding] = []
    sources = {given.GetBaseName(): _source(given, where, found) for given in surface.GetInputs()}
    known: dict[Sdf.Path, Texture | None] = {}

    def source(role: str) -> _Source:
        return sources.get(role, _Source())

    def texture(role: str) -> Texture | None:
        shader, channel = source(role).texture, source(role).channel
        if shader is None:
            return None
        if shader.GetPath() not in known:
            known[shader.GetPath()] = read_texture(shader, found)
        image = known[shader.GetPath()]
        return replace(image, channel="" if channel == "rgb" else channel) if image else None

    def color(role: str, default: Colour) -> Colour:
        shader, value = source(role).texture, source(role).value
        if shader is not None:
            _no_bias(shader, (0.0, 0.0, 0.0), found)
            value = scale_of(shader)
        return default if value is None else (float(value[0]), float(value[1]), float(value[2]))

    def number(role: str, default: float) -> float:
        shader, value = source(role).texture, source(role).value
        if shader is not None:
            place = "rgba".find(source(role).channel)
            if role != "occlusion":
                _no_bias(shader, (0.0, 0.0, 0.0), found)
            return scale_of(shader)[max(place, 0)]
        return default if value is None else float(value)

    kept = our_notes(material)
    colours = source("diffuseColor")
    threshold = number("opacityThreshold", 0.0)
    opacity, seen_through = number("opacity", 1.0), texture("opacity")
    mode: AlphaMode = "opaque"
    if threshold > 0:
        mode = "mask"
    elif opacity < 1 or seen_through or source("opacity").primvar or _is_present(source):
        mode = "blend"
    if source("useSpecularWorkflow").value:
        message = "the specular workflow is read as a dielectric of that colour"
        found.append(finding("FEATURE_APPROXIMATED", where, message))
    if source("displacement").texture or source("displacement").value:
        found.append(finding("FEATURE_DROPPED", where, "displacement is not kept"))
    for role in ("clearcoat", "clearcoatRoughness", "ior"):
        if source(role).texture:
            found.append(finding("FEATURE_DROPPED", where, f"the texture of {role} is not kept"))
    bump = source("normal").texture
    extras, news = read_extras(material.GetPrim())
    found += news
    unlit = bool(kept.get("unlit"))
    shown, glow = ("emissiveColor", "") if unlit else ("diffuseColor", "emissiveColor")
    result = Material(
        name,
        color(shown, Material("").base_color),
        opacity,
        number("metallic", 0.0),
        number("roughness", 0.5),
        color(glow, Material("").emissive),
        alpha_mode=mode,
        alpha_cutoff=threshold if mode == "mask" else 0.5,
        ior=number("ior", 1.5),
        clearcoat=number("clearcoat", 0.0),
        clearcoat_roughness=number("clearcoatRoughness", 0.01),
        normal_scale=float(kept.get("normalScale", scale_of(bump)[0] / 2)) if bump else 1.0,
        occlusion_strength=number("occlusion", 1.0) if source("occlusion").texture else 1.0,
        vertex_colours=colours.primvar == "displayColor" or bool(kept.get("vertexColors")),
        unlit=unlit,
        base_color_texture=texture(shown),
        opacity_texture=seen_through,
        metallic_texture=texture("metallic"),
        roughness_texture=texture("roughness"),
        normal_texture=texture("normal"),
        occlusion_texture=texture("occlusion"),
        emissive_texture=texture(glow),
        extras=extras,
    )
    return result, found


def _is_present(source: Callable[[str], _Source]) -> bool:
    return bool(source("opacityMode").value == "presence")


def _no_bias(shader: UsdShade.Shader, wanted: Colour, found: list[Finding]) -> None:
    given = shader.GetInput("bias")
    bias = given.Get() if given else None
    if bias is not None and tuple(bias)[:3] != wanted:
        message = "glTF has no bias of textures; it is left out"
        found.append(finding("FEATURE_DROPPED", str(shader.GetPath()), message))


def _source(given: UsdShade.Input, where: str, found: list[Finding]) -> _Source:
    producers = given.GetValueProducingAttributes()
    if not producers:
        return _Source()
    if not UsdShade.Output.IsOutput(producers[0]):
        return _Source(producers[0].Get())
    shader = UsdShade.Shader(producers[0].GetPrim())
    kind = str(shader.GetShaderId())
    if kind == "UsdUVTexture":
        return _Source(None, shader, UsdShade.Output(producers[0]).GetBaseName())
    if kind.startswith("UsdPrimvarReader_") and given.GetBaseName() in ("diffuseColor", "opacity"):
        primvar = str(value_of(shader, "varname"))
        if primvar in ("displayColor", "displayOpacity"):
            fallback = value_of(shader, "fallback")
            return _Source(fallback, primvar=primvar)
    message = f"{given.GetBaseName()} comes from a shader node that is not kept"
    found.append(finding("FEATURE_DROPPED", where, message))
    return _Source()
