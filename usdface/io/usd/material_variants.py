"""Material variants as a variant set of ``/Asset``, read and written.

Each variant binds other materials. Bindings of meshes that have variants stand in the variants
alone, also those of the default look (``default``): opinions of the prim itself are stronger.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from pxr import Usd, UsdShade

from usdface.io.prim_names import prim_names
from usdface.io.usd.conversion_metadata import read_metadata, write_metadata
from usdface.io.usd.mesh import bound_material
from usdface.io.usd.variant_stages import stage_with_variant
from usdface.rigs import MaterialVariant, Mesh

__all__ = ["read_material_variants", "write_material_variants"]

_SET, _DEFAULT, _NAMES = "material", "default", "materialVariants"


def read_material_variants(stage: Usd.Stage, meshes: Sequence[Mesh]) -> tuple[Mesh, ...]:
    """Return the meshes with the variants that the default prim's set ``material`` chooses from.

    Materials are prim paths. The stage is not changed.
    """
    top = stage.GetDefaultPrim()
    if not top or not top.GetVariantSets().HasVariantSet(_SET) or top.IsInstance():
        return tuple(meshes)
    labels = read_metadata(top).get(_NAMES, {})
    found: list[list[MaterialVariant]] = [[] for _ in meshes]
    for variant in top.GetVariantSet(_SET).GetVariantNames():
        other = stage_with_variant(stage, top.GetPath(), _SET, variant)
        looks = [_changed(stage, other, mesh) for mesh in meshes]
        if variant == _DEFAULT and not any(looks):
            continue
        name = str(labels.get(variant, variant))
        for own, look in zip(found, looks, strict=True):
            own.append(MaterialVariant(name, look))
    return tuple(replace(m, variants=tuple(v)) for m, v in zip(meshes, found, strict=True))


def _changed(stage: Usd.Stage, other: Usd.Stage, mesh: Mesh) -> dict[str, str]:
    """Return the materials of a mesh that are others on the other stage, by those on this one."""
    changed: dict[str, str] = {}
    for prim in _bound_prims(stage.GetPrimAtPath(mesh.path)):
        same = other.GetPrimAtPath(prim.GetPath())
        before, after = bound_material(prim), bound_material(same) if same else ""
        if after and after != before:
            changed.setdefault(before, after)
    return changed


def _bound_prims(prim: Usd.Prim) -> list[Usd.Prim]:
    subsets = UsdShade.MaterialBindingAPI(prim).GetMaterialBindSubsets()
    return [prim, *(subset.GetPrim() for subset in subsets)]


def write_material_variants(
    stage: Usd.Stage, meshes: Mapping[str, Mesh], materials: Mapping[str, UsdShade.Material]
) -> None:
    """Author the variants of meshes, by prim path, that are bound to the materials by name."""
    names = list(dict.fromkeys(v.name for mesh in meshes.values() for v in mesh.variants))
    if not names:
        return
    known = {str(material.GetPath()): name for name, material in materials.items()}
    bound: list[tuple[Usd.Prim, str, Mesh]] = []
    for path, mesh in meshes.items():
        for prim in _bound_prims(stage.GetPrimAtPath(path)):
            base = known.get(bound_material(prim), "")
            if base and any(base in variant.materials for variant in mesh.variants):
                bound.append((prim, base, mesh))
    for prim, _, _ in bound:
        prim.RemoveProperty("material:binding")
    top = stage.GetDefaultPrim()
    variants = top.GetVariantSets().AddVariantSet(_SET)
    legal = prim_names(names, (_DEFAULT,))
    write_metadata(top, _NAMES, dict(zip(legal, names, strict=True)))
    for variant, name in zip((_DEFAULT, *legal), ("", *names), strict=True):
        variants.AddVariant(variant)
        variants.SetVariantSelection(variant)
        with variants.GetVariantEditContext():
            for prim, base, mesh in bound:
                look = next((v.materials for v in mesh.variants if v.name == name), {})
                chosen = materials.get(look.get(base, base), materials[base])
                UsdShade.MaterialBindingAPI(prim).Bind(chosen)
    variants.SetVariantSelection(_DEFAULT)
