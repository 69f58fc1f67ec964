"""Instances of a mesh (EXT_mesh_gpu_instancing) as nodes, one each.

Source: EXT_mesh_gpu_instancing: each instance stands in its node by a translation, rotation, scale.
"""

from copy import copy, deepcopy
from dataclasses import replace
from typing import Any

import numpy as np
from pygltflib import Node

from usdface.arrays import FloatArray
from usdface.errors import InputError
from usdface.io.gltf.accessors import AccessorReader
from usdface.io.gltf.document import GltfFile

__all__ = ["INSTANCES", "expand_instances"]

INSTANCES = "EXT_mesh_gpu_instancing"
_MOST_INSTANCES = 1024  # in a file; of more none is expanded
_PARTS = {"TRANSLATION": "VEC3", "ROTATION": "VEC4", "SCALE": "VEC3"}


def _instance_count(file: GltfFile) -> int:
    """Return how many instances the scene of a file has."""
    reader = AccessorReader(file)
    return sum(_count(node, reader) for node in _instanced(file))


def _instanced(file: GltfFile) -> list[Node]:
    return [
        node
        for node in file.document.nodes or []
        if isinstance((node.extensions or {}).get(INSTANCES), dict) and node.mesh is not None
    ]


def _attributes(node: Node) -> dict[str, Any]:
    given = node.extensions[INSTANCES].get("attributes")
    return given if isinstance(given, dict) else {}


def _count(node: Node, reader: AccessorReader) -> int:
    return max((reader.count(accessor) for accessor in _attributes(node).values()), default=1)


def expand_instances(file: GltfFile) -> GltfFile:
    """Return a file in which each instance is a node below the one that had the mesh.

    The weights of that node, also in animations, are those of all its instances. Meshes with a
    skin, which stand where their joints do, stay as they are, and so does a file with more than
    1,024 instances.

    Raises
    ------
    InputError
        If the numbers of an instance do not fit each other.
    """
    instanced = [node for node in _instanced(file) if node.skin is None]
    if not instanced or _instance_count(file) > _MOST_INSTANCES:
        return file
    reader = AccessorReader(file)
    document = copy(file.document)
    document.nodes, weights = list(document.nodes), list(file.node_weights)
    document.animations = deepcopy(document.animations)
    for node in instanced:
        index = document.nodes.index(node)
        kept = {k: v for k, v in node.extensions.items() if k != INSTANCES}
        places = range(len(document.nodes), len(document.nodes) + _count(node, reader))
        parts = {name: _numbers(node, name, len(places), reader) for name in _PARTS}
        name = node.name or document.meshes[node.mesh].name or "Mesh"
        for k in range(len(places)):
            given = {key.lower(): v[k].tolist() for key, v in parts.items() if v is not None}
            document.nodes.append(Node(name=f"{name}_{k}", mesh=node.mesh, **given))
            weights.append(weights[index])
        document.nodes[index] = replace(
            node, mesh=None, extensions=kept, children=[*(node.children or []), *places]
        )
        weights[index] = None
        for animation in document.animations or []:
            channels = animation.channels or []
            moving = [c for c in channels if c.target.node == index and c.target.path == "weights"]
            copies = [deepcopy(channel) for channel in moving for _ in places]
            for place, channel in zip([*places] * len(moving), copies, strict=True):
                channel.target.node = place
            animation.channels = [c for c in channels if c not in moving] + copies
    return replace(file, document=document, node_weights=tuple(weights))


def _numbers(node: Node, name: str, count: int, reader: AccessorReader) -> FloatArray | None:
    accessor = _attributes(node).get(name)
    if accessor is None:
        return None
    values = reader.floats(accessor, _PARTS[name])
    if len(values) != count or not np.isfinite(values).all():
        raise InputError(f"the instances of node {node.name!r} have {len(values)} times {name}")
    return values
