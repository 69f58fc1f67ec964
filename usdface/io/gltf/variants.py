"""Material variants of glTF, read and written.

Source: KHR_materials_variants.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from pygltflib import GLTF2, Primitive

from usdface.findings import Finding, finding
from usdface.io.gltf.document import item
from usdface.io.gltf.read_weights import PlacedMesh
from usdface.io.gltf.target_names import legal_text
from usdface.rigs import MaterialVariant, Mesh

__all__ = ["VARIANTS", "read_variants", "write_variants"]

VARIANTS = "KHR_materials_variants"


def read_variants(
    document: GLTF2,
    meshes: Sequence[PlacedMesh],
    finished: Sequence[Mesh],
    materials: Sequence[str],
) -> tuple[tuple[Mesh, ...], list[Finding]]:
    """Return the meshes with the variants of their primitives' materials.

    Primitives of a mesh that share a material share its variants: where they have other ones the
    first counts (EXTENSION_DROPPED).

    Raises
    ------
    InputError
        If a mapping names a material or variant that does not exist.
    """
    listed = (document.extensions or {}).get(VARIANTS, {}).get("variants") or []
    names = [legal_text(str(v.get("name") or f"variant {k}")) for k, v in enumerate(listed)]
    if not names:
        return tuple(finished), []
    found: list[Finding] = []
    result = []
    for placed, mesh in zip(meshes, finished, strict=True):
        chosen: list[dict[str, str]] = [{} for _ in names]
        source = document.meshes[document.nodes[placed.node].mesh]
        doubtful = False
        for primitive in source.primitives or []:
            base = "" if primitive.material is None else materials[primitive.material]
            for number, material in _mappings(primitive):
                item(names, number, "material variant")
                other = item(materials, material, "material")
                doubtful |= chosen[number].setdefault(base, other) != other
        if doubtful:
            message = "parts of {part} share a material and not its variants; the first counts"
            found.append(finding("EXTENSION_DROPPED", VARIANTS, message, mesh.name))
        variants = zip(names, chosen, strict=True)
        result.append(replace(mesh, variants=tuple(MaterialVariant(n, c) for n, c in variants)))
    return tuple(result), found


def _mappings(primitive: Primitive) -> Iterator[tuple[Any, Any]]:
    given = (primitive.extensions or {}).get(VARIANTS)
    for mapping in (given.get("mappings") or []) if isinstance(given, Mapping) else []:
        for number in mapping.get("variants") or []:
            yield number, mapping.get("material")


def write_variants(
    carriers: Sequence[tuple[int, Mesh]], materials: Sequence[str], document: GLTF2
) -> None:
    """Put the variants of the meshes into a document with materials of these names."""
    names = list(dict.fromkeys(v.name for _, mesh in carriers for v in mesh.variants))
    if not names:
        return
    place = {name: k for k, name in enumerate(materials)}
    for node, mesh in carriers:
        for primitive in document.meshes[document.nodes[node].mesh].primitives:
            base = "" if primitive.material is None else materials[primitive.material]
            shown: dict[int, list[int]] = {}
            for variant in mesh.variants:
                other = place.get(variant.materials.get(base, ""))
                if other is not None and base in variant.materials:
                    shown.setdefault(other, []).append(names.index(variant.name))
            if shown:
                mappings = [{"material": m, "variants": v} for m, v in shown.items()]
                primitive.extensions = {**(primitive.extensions or {})}
                primitive.extensions[VARIANTS] = {"mappings": mappings}
    document.extensions[VARIANTS] = {"variants": [{"name": name} for name in names]}
    document.extensionsUsed = sorted({*(document.extensionsUsed or []), VARIANTS})
