"""Materials of a USD stage: UsdPreviewSurface.

Source: OpenUSD, "UsdPreviewSurface Specification" 2.6.
"""

import itertools
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from pxr import Usd, UsdGeom, UsdShade

from usdface.findings import Finding, finding
from usdface.io.usd.conversion_metadata import read_metadata
from usdface.io.usd.extras import read_extras
from usdface.io.usd.preview_surface import Surface
from usdface.io.usd.stage import stage_name
from usdface.io.usd.textures import scale_of, value_of
from usdface.materials import AlphaMode, Material, Texture
from usdface.rigs import MaterialSubset, MaterialVariant, Mesh

__all__ = ["read_mesh_materials", "report_unbound_materials"]

_GREY, _BLACK = (0.18, 0.18, 0.18), (0.0, 0.0, 0.0)  # fallbacks of the schema


def read_mesh_materials(
    stage: Usd.Stage, meshes: tuple[Mesh, ...], asset_root: Path | None
) -> tuple[tuple[Mesh, ...], tuple[Material, ...], list[Finding]]:
    """Read the materials that `meshes` name by prim path, and name them by their own names.

    Textures elsewhere than `usdface.io.usd.textures.read_texture` allows are left out, with a
    finding.
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
            findings.append(
                finding("NAME_CHANGED", path, "{original!r} is now {name!r}", wanted, names[path])
            )
        material, notes = _read_material(UsdShade.Material(prim), names[path], asset_root)
        sided = any(path in _bound(m) and _is_double_sided(stage, m) for m in meshes)
        single = bool(read_metadata(prim).get("singleSided"))
        materials.append(replace(material, double_sided=sided and not single))
        findings += notes
    named = tuple(
        replace(
            mesh,
            material=names[mesh.material],
            subsets=tuple(MaterialSubset(names[s.material], s.faces) for s in mesh.subsets),
            variants=tuple(_named(variant, names) for variant in mesh.variants),
        )
        for mesh in meshes
    )
    return named, tuple(materials), findings


def report_unbound_materials(stage: Usd.Stage, meshes: Iterable[Mesh]) -> list[Finding]:
    """Return CHANNEL_IGNORED for materials that none of `meshes` shows, which name prim paths."""
    bound = {path for mesh in meshes for path in _bound(mesh)}
    paths = (str(p.GetPath()) for p in stage.Traverse() if p.IsA(UsdShade.Material))
    if not (names := [path for path in paths if path not in bound]):
        return []
    where = stage_name(stage)
    return [finding("CHANNEL_IGNORED", where, "materials that no mesh shows: {channels}", names)]


def _named(variant: MaterialVariant, names: Mapping[str, str]) -> MaterialVariant:
    known = {base: other for base, other in variant.materials.items() if base in names}
    return MaterialVariant(variant.name, {names[b]: names[o] for b, o in known.items()})


def _bound(mesh: Mesh) -> tuple[str, ...]:
    others = (other for variant in mesh.variants for other in variant.materials.values())
    return (*mesh.materials, *others)


def _is_double_sided(stage: Usd.Stage, mesh: Mesh) -> bool:
    return bool(UsdGeom.Mesh(stage.GetPrimAtPath(mesh.path)).GetDoubleSidedAttr().Get())


def _read_material(
    material: UsdShade.Material, name: str, asset_root: Path | None
) -> tuple[Material, list[Finding]]:
    where = str(material.GetPath())
    shader = material.ComputeSurfaceSource()[0]
    if not shader or shader.GetShaderId() != "UsdPreviewSurface":
        message = "the material is not a UsdPreviewSurface; a grey one stands for it"
        return Material(name), [finding("FEATURE_DROPPED", where, message, feature="material")]
    lost = _other_outputs(material, shader)
    surface, kept = Surface(shader, where, asset_root), read_metadata(material)
    colour, number, texture = surface.colour, surface.number, surface.texture
    threshold = number("opacityThreshold", 0.0)
    opacity, seen_through = number("opacity", 1.0), texture("opacity")
    lost += _dropped_inputs(surface, where)
    bump = surface.source("normal").texture
    extras, new_findings = read_extras(material.GetPrim())
    unlit = bool(kept.get("unlit"))
    by_vertex = surface.source("diffuseColor").primvar == "displayColor"
    shown, glow = ("emissiveColor", "") if unlit else ("diffuseColor", "emissiveColor")
    result = Material(
        name,
        colour(shown, _BLACK if unlit else _GREY),
        opacity,
        number("metallic", 0.0),
        number("roughness", 0.5),
        colour(glow, Material("").emissive),
        alpha_mode=_alpha_mode(surface, threshold, opacity, seen_through),
        alpha_cutoff=threshold if threshold > 0 else 0.5,
        ior=number("ior", 1.5),
        clearcoat=number("clearcoat", 0.0),
        clearcoat_roughness=number("clearcoatRoughness", 0.01),
        normal_scale=float(kept.get("normalScale", scale_of(bump)[0] / 2)) if bump else 1.0,
        occlusion_strength=number("occlusion", 1.0) if surface.source("occlusion").texture else 1.0,
        vertex_colours=by_vertex or bool(kept.get("vertexColors")),
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
    return result, [*surface.findings, *lost, *new_findings]


def _other_outputs(material: UsdShade.Material, surface: UsdShade.Shader) -> list[Finding]:
    """Report networks for other renderers, and of displacement or volume, that are left out."""
    producers = {
        output.GetFullName(): output.GetValueProducingAttributes()
        for output in material.GetOutputs()
    }
    names = [n for n, p in producers.items() if p and p[0].GetPrim() != surface.GetPrim()]
    if not names:
        return []
    message = "shader networks that are not kept: {channels}"
    return [finding("CHANNEL_IGNORED", str(material.GetPath()), message, sorted(names))]


def _alpha_mode(
    surface: Surface, threshold: float, opacity: float, seen_through: Texture | None
) -> AlphaMode:
    if threshold > 0:
        return "mask"
    present = surface.source("opacityMode").value == "presence"
    blends = opacity < 1 or seen_through or surface.source("opacity").primvar or present
    return "blend" if blends else "opaque"


def _is_of_gltf(bump: UsdShade.Shader) -> bool:
    """Return whether a normal map is read as glTF does: x and y by a strength, from -1 to 1."""
    across, up, out = scale_of(bump)[:3]
    bias = np.array(value_of(bump, "bias") or (0.0,) * 4)[:3]
    shifted = np.allclose(bias, [-across / 2, -up / 2, -1.0], atol=1e-3)
    return bool(shifted and abs(across - up) < 1e-3 and abs(out - 2.0) < 1e-3)


def _dropped_inputs(surface: Surface, where: str) -> list[Finding]:
    """Return a finding for the inputs of a surface that `Material` does not have."""
    found = []
    if surface.source("useSpecularWorkflow").value:
        message = "the specular workflow is read as a dielectric of that colour"
        found.append(finding("FEATURE_APPROXIMATED", where, message, feature="specular_workflow"))
    if surface.source("displacement").texture or surface.source("displacement").value:
        found.append(
            finding("FEATURE_DROPPED", where, "displacement is not kept", feature="displacement")
        )
    bump = surface.source("normal").texture
    if bump is not None and not _is_of_gltf(bump):
        message = "its scale and bias are others than those by which glTF reads normal maps"
        found.append(
            finding("FEATURE_APPROXIMATED", str(bump.GetPath()), message, feature="normal_map")
        )
    if surface.source("occlusion").value not in (None, 1.0):
        message = "occlusion without a texture is not kept: glTF has none"
        found.append(finding("FEATURE_DROPPED", where, message, feature="occlusion"))
    for name in ("clearcoat", "clearcoatRoughness", "ior"):
        if surface.source(name).texture:
            found.append(
                finding(
                    "FEATURE_DROPPED",
                    where,
                    "the texture of {attribute} is not kept",
                    name,
                    feature="texture",
                )
            )
    return found
