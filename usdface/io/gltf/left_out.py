"""What a glTF holds that is not read: extensions of its parts, nodes that carry nothing."""

from collections.abc import Collection, Iterator, Mapping
from typing import Any

from pygltflib import GLTF2

from usdface.findings import Finding, finding
from usdface.io.gltf.nodes import NodeTree
from usdface.io.gltf.vrm import VRM_NAMES

__all__ = ["report_extensions", "report_nodes"]

_INSTANCES, _VARIANTS = "EXT_mesh_gpu_instancing", "KHR_materials_variants"
# Read elsewhere, and reported there where something of it is not.
_READ = {
    *("KHR_lights_punctual", "KHR_draco_mesh_compression", "KHR_animation_pointer"),
    *("EXT_meshopt_compression", "KHR_meshopt_compression", *VRM_NAMES),
}
_SOME = 3  # names in a message


def report_extensions(document: GLTF2) -> list[Finding]:
    """Return EXTENSION_DROPPED for each extension whose data are not read.

    Those of materials, textures and accessors are reported where these are read.
    """
    places: dict[str, list[tuple[str, Any]]] = {}
    for where, extensions in _extensions(document):
        for name, value in extensions.items():
            if name not in _READ:
                places.setdefault(name, []).append((where, value))
    return [
        finding("EXTENSION_DROPPED", name, *_message(name, found, document))
        for name, found in places.items()
    ]


def _message(name: str, found: list[tuple[str, Any]], document: GLTF2) -> tuple[Any, ...]:
    where = found[0][0] + (f" and {len(found) - 1} more" if found[1:] else "")
    if name == _INSTANCES:
        count = sum(_instances(value, document) for _, value in found)
        return (
            "{instance_count} instances of {part} become one each: they are left out",
            count,
            where,
        )
    if name == _VARIANTS:
        named = [v.get("name") for _, value in found for v in _variants(value)]
        message = "the material variants {variants} are left out; the default materials are kept"
        return message, named or [where]
    return "its data are left out: {part}", where


def _instances(value: Any, document: GLTF2) -> int:
    attributes = value.get("attributes") if isinstance(value, Mapping) else None
    accessors = document.accessors or []
    counts = [
        accessors[k].count or 0
        for k in (attributes.values() if isinstance(attributes, Mapping) else ())
        if isinstance(k, int) and 0 <= k < len(accessors)
    ]
    return max(counts, default=0)


def _variants(value: Any) -> list[Mapping[str, Any]]:
    listed = value.get("variants") if isinstance(value, Mapping) else None
    return [v for v in listed if isinstance(v, Mapping)] if isinstance(listed, list) else []


def _extensions(document: GLTF2) -> Iterator[tuple[str, Mapping[str, Any]]]:
    parts: list[tuple[str, Any]] = [("the file", document)]
    for kind, items in (
        ("scene", document.scenes),
        ("node", document.nodes),
        ("mesh", document.meshes),
        ("skin", document.skins),
        ("animation", document.animations),
        ("camera", document.cameras),
    ):
        parts += [(f"{kind} {k}", part) for k, part in enumerate(items or [])]
    for k, mesh in enumerate(document.meshes or []):
        parts += [(f"a primitive of mesh {k}", part) for part in mesh.primitives or []]
    for where, part in parts:
        extensions = getattr(part, "extensions", None)
        if isinstance(extensions, Mapping):
            yield where, extensions


def report_nodes(document: GLTF2, tree: NodeTree, joints: Collection[int]) -> list[Finding]:
    """Return NODES_DROPPED for nodes that are not kept as such, and a finding for their extras."""
    bare, with_extras = [], []
    for index in tree.order:
        node = document.nodes[index]
        lights = "KHR_lights_punctual" in (node.extensions or {})
        if node.mesh is not None or node.camera is not None or lights:
            continue
        if index not in joints:
            bare.append(node.name or f"node {index}")
        if isinstance(node.extras, Mapping) and node.extras:
            with_extras.append(node.name or f"node {index}")
    found = []
    if bare:
        message = "{node_count} nodes are left out, their transforms kept: {nodes}"
        found.append(finding("NODES_DROPPED", "nodes", message, len(bare), bare))
    if with_extras:
        message = "extras of {node_count} nodes are left out: {nodes}"
        found.append(
            finding(
                "FEATURE_DROPPED", "nodes", message, len(with_extras), with_extras, feature="extras"
            )
        )
    return found


def _listed(names: list[str]) -> str:
    return ", ".join(names[:_SOME]) + (", ..." if len(names) > _SOME else "")
