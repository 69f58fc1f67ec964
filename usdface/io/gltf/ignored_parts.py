"""Parts of a glTF that are not read: extensions, extras, contents of no node, names."""

from collections.abc import Collection, Container, Mapping
from typing import Any

import numpy as np
from pygltflib import GLTF2

from usdface.findings import Finding, finding
from usdface.io.gltf.document import GltfFile
from usdface.io.gltf.extras import RESERVED
from usdface.io.gltf.instances import INSTANCES
from usdface.io.gltf.nodes import NodeTree
from usdface.io.gltf.target_names import legal_text
from usdface.io.gltf.variants import VARIANTS
from usdface.io.gltf.vrm import VRM_NAMES
from usdface.io.gltf.vrm_nodes import AVATAR_EXTENSIONS

__all__ = [
    "report_extensions",
    "report_extras",
    "report_names",
    "report_pivots",
    "report_unplaced",
]

_LIGHTS = "KHR_lights_punctual"
# Read elsewhere, and reported there where something of it is not.
_READ = {
    *(_LIGHTS, "KHR_draco_mesh_compression", "KHR_animation_pointer"),
    *("EXT_meshopt_compression", "KHR_meshopt_compression", "EXT_texture_webp", *VRM_NAMES),
    *("KHR_texture_transform", VARIANTS),
}
# Parts whose extras are kept: asset, the default scene, nodes and their contents.
_WITH_EXTRAS = (("asset",), ("scenes",), ("nodes",), ("meshes",), ("materials",), ("cameras",))
# Parts whose names are kept.
_WITH_NAMES = ("nodes", "meshes", "materials", "cameras", "animations", "textures", "images")


def report_extensions(file: GltfFile) -> list[Finding]:
    """Return EXTENSION_DROPPED for each extension whose data are not read, wherever it stands.

    Those of materials are reported where these are read.
    """
    places: dict[str, list[tuple[str, Any]]] = {}
    avatar = any(name in (file.document.extensions or {}) for name in VRM_NAMES)
    read = {*_READ, *(AVATAR_EXTENSIONS if avatar else ())}
    for part in file.user_data:
        for name, value in part.extensions.items():
            if name == INSTANCES and not _still_there(part.path, file.document):
                continue
            if name not in read and (part.path[:1] != ("materials",) or len(part.path) > 2):
                places.setdefault(name, []).append((part.where, value))
    return [
        finding("EXTENSION_DROPPED", name, *_message(name, found, file.document))
        for name, found in places.items()
    ]


def _still_there(path: tuple[str | int, ...], document: GLTF2) -> bool:
    """Return whether the instances of a node were not expanded."""
    if len(path) != 2 or path[0] != "nodes":
        return True
    return INSTANCES in (document.nodes[int(path[1])].extensions or {})


def _message(name: str, found: list[tuple[str, Any]], document: GLTF2) -> tuple[Any, ...]:
    where = found[0][0] + (f" and {len(found) - 1} more" if found[1:] else "")
    if name == INSTANCES:
        count = sum(_instances(value, document) for _, value in found)
        message = "{instance_count} instances of {part} become one each: they are left out"
        return message, count, where
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


def report_extras(file: GltfFile) -> list[Finding]:
    """Return FEATURE_DROPPED for extras of parts that have none here, and that are no object."""
    lost: dict[str, None] = {}
    shown = file.document.scene or 0
    for part in file.user_data:
        kept = part.path[:1] in _WITH_EXTRAS and len(part.path) <= 2
        kept &= part.path[:1] != ("scenes",) or part.path[1] == shown
        if isinstance(part.extras, Mapping):
            if not kept and set(part.extras) - set(RESERVED):
                lost[part.where] = None
        elif part.extras is not None:
            lost[part.where] = None
    if not lost:
        return []
    message = "extras of {parts} are left out"
    return [finding("FEATURE_DROPPED", "extras", message, list(lost), feature="extras")]


def report_names(file: GltfFile, kept: Collection[str]) -> list[Finding]:
    """Return NAME_DROPPED for each kind of parts whose names a rig does not know.

    All skins become one, with the first of their names. Accessors may have named morph targets,
    which are among the names `kept`.
    """
    document = file.document
    skins = [skin.name for skin in document.skins or [] if skin.name][:1]
    known = {*kept, *skins}
    lost: dict[str, list[str]] = {}
    for part in file.user_data:
        kind = str(part.path[0]) if part.path else ""
        named = kind in _WITH_NAMES or part.path == ("scenes", document.scene or 0)
        if part.name and not (named and len(part.path) == 2) and part.name not in known:
            lost.setdefault(kind, []).append(legal_text(part.name))
    message = "names of {kind} are left out: {names}"
    return [
        finding("NAME_DROPPED", kind, message, kind, list(dict.fromkeys(names)))
        for kind, names in lost.items()
    ]


def report_pivots(document: GLTF2, tree: NodeTree, joints: Container[int]) -> list[Finding]:
    """Return PIVOTS_DROPPED for nodes of meshes that stand by transforms, not by a skin or joint.

    Of quantised meshes the transform is mostly that of the quantisation, and not reported.
    """
    if "KHR_mesh_quantization" in (document.extensionsUsed or []):
        return []
    nodes = document.nodes or []
    moved = [
        nodes[n].name or f"node {n}"
        for n in tree.order
        if n in tree.scene and nodes[n].mesh is not None and nodes[n].skin is None
        if not np.allclose(tree.below(n, tree.nearest(n, joints)), np.eye(4))
    ]
    message = "transforms are applied to the points of {meshes}; their pivots are not kept"
    return [finding("PIVOTS_DROPPED", "nodes", message, moved)] if moved else []


def report_unplaced(document: GLTF2) -> list[Finding]:
    """Return FEATURE_DROPPED for meshes, cameras and lights of no node, and unused images.

    Meshes, cameras and lights may be in any scene.
    """
    nodes = document.nodes or []
    lights = ((document.extensions or {}).get(_LIGHTS) or {}).get("lights") or []
    placed = [(node.extensions or {}).get(_LIGHTS) or {} for node in nodes]
    parts: dict[str, tuple[list[Any], set[Any]]] = {
        "mesh": ([m.name for m in document.meshes or []], {n.mesh for n in nodes}),
        "camera": ([c.name for c in document.cameras or []], {n.camera for n in nodes}),
        "light": ([one.get("name") for one in lights], {one.get("light") for one in placed}),
        "image": ([one.name for one in document.images or []], _shown_images(document)),
    }
    found = []
    for kind, (given, shown) in parts.items():
        names = [name or f"{kind} {k}" for k, name in enumerate(given) if k not in shown]
        message = f"left out, as no {'material' if kind == 'image' else 'node'} has them: {{names}}"
        lost = finding("FEATURE_DROPPED", kind, message, names, feature=kind)
        found += [lost] if names else []
    return found


def _shown_images(document: GLTF2) -> set[Any]:
    """Return the indices of images that textures of materials name, also by an extension."""
    textures, found = document.textures or [], set()
    waiting: list[Any] = list(document.materials or [])
    while waiting:
        part = waiting.pop()
        values = part if isinstance(part, dict) else getattr(part, "__dict__", {})
        waiting += [value for key, value in values.items() if key != "extras"]
        index = values.get("index")
        if isinstance(index, int) and 0 <= index < len(textures) and textures[index]:
            others = (textures[index].extensions or {}).values()
            found |= {
                textures[index].source,
                *(o.get("source") for o in others if isinstance(o, dict)),
            }
    return found
