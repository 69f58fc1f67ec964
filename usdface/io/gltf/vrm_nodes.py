"""Parts of an avatar that name nodes: spring bones, constraints, first person, gaze.

They are kept as text, in the extras of the file under ``vrm``: the JSON of the part, in which a
node is ``{"joint": path}``, ``{"group": path}`` or ``{"mesh": name}``, since its number is another
in another file.

Source: VRM 0.x (secondaryAnimation, firstPerson), VRMC_vrm 1.0 (firstPerson, lookAt),
VRMC_springBone 1.0, VRMC_node_constraint 1.0.
"""

import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from pygltflib import GLTF2, Node

from usdface.findings import Finding, finding
from usdface.io.unique_name import unique_name
from usdface.rigs import Mesh

__all__ = [
    "AVATAR_EXTENSIONS",
    "NODE_PARTS",
    "NamedNodes",
    "mesh_numbers",
    "read_vrm_nodes",
    "write_vrm_nodes",
]

# Parts of the extension of each version.
NODE_PARTS = {
    "VRM": ("firstPerson", "secondaryAnimation"),
    "VRMC_vrm": ("firstPerson", "lookAt"),
}
_SPRINGS, _CONSTRAINT = AVATAR_EXTENSIONS = ("VRMC_springBone", "VRMC_node_constraint")
_NODES = ("node", "center", "source", "firstPersonBone")  # keys of the number of a node
_LISTS = ("bones",)  # keys of several


@dataclass(frozen=True, eq=False, slots=True)
class NamedNodes:
    """Nodes of a file by kind ("joint", "group", "mesh") and name."""

    numbers: Mapping[str, Mapping[str, int]]

    def named(self, node: int) -> dict[str, str]:
        """Return kind and name of a node.

        Raises
        ------
        LookupError
            If it is not kept.
        """
        for kind, numbers in self.numbers.items():
            for name, number in numbers.items():
                if number == node:
                    return {kind: name}
        raise LookupError(node)

    def number(self, named: Mapping[str, str]) -> int:
        """Return the number of a node; raises LookupError if there is none."""
        ((kind, name),) = named.items()
        return self.numbers[kind][name]


def mesh_numbers(carriers: Iterable[tuple[int, Mesh]]) -> dict[str, int]:
    """Return the node of each mesh by its name; of meshes of one name the later are numbered."""
    carriers = list(carriers)
    taken = {mesh.name for _, mesh in carriers}
    numbers: dict[str, int] = {}
    for node, mesh in carriers:
        name = unique_name(mesh.name, taken) if mesh.name in numbers else mesh.name
        taken.add(name)
        numbers[name] = node
    return numbers


def read_vrm_nodes(document: GLTF2, nodes: NamedNodes) -> tuple[dict[str, str], list[Finding]]:
    """Return the parts of an avatar that name nodes, as texts by name.

    One that names a node which is not kept is left out (EXTENSION_DROPPED).
    """
    parts: dict[str, tuple[str, Any]] = {}
    for extension, names in NODE_PARTS.items():
        given = (document.extensions or {}).get(extension)
        if isinstance(given, Mapping):
            parts |= {name: (extension, given[name]) for name in names if name in given}
    springs = (document.extensions or {}).get(_SPRINGS)
    if isinstance(springs, Mapping):
        parts["springBone"] = _SPRINGS, springs
    constraints = [
        {"node": index, "constraint": held}
        for index, node in enumerate(document.nodes or [])
        if isinstance(held := (node.extensions or {}).get(_CONSTRAINT), Mapping)
    ]
    if constraints:
        parts["constraints"] = _CONSTRAINT, constraints
    made, found = {}, []

    def mesh(number: int) -> Any:
        carrier = next(k for k, node in enumerate(document.nodes) if node.mesh == number)
        return nodes.named(carrier)

    for name, (extension, content) in parts.items():
        try:
            made[name] = json.dumps(_replaced(content, nodes.named, mesh), ensure_ascii=False)
        except (LookupError, StopIteration, RecursionError):
            message = "{part} of an avatar names a node that is not kept, and is left out"
            found.append(finding("EXTENSION_DROPPED", extension, message, name))
    return made, found


def write_vrm_nodes(
    avatar: Mapping[str, Any], version: str, nodes: NamedNodes, document: GLTF2
) -> list[Finding]:
    """Put the parts of an avatar that name nodes into a document that has its other extension.

    One that names a node which is no more is left out (EXTENSION_DROPPED).
    """
    found = []
    used = {*(document.extensionsUsed or [])}

    def mesh(named: Mapping[str, str]) -> int:
        return int(document.nodes[nodes.number(named)].mesh)

    def constrained(content: Any) -> list[tuple[Node, Any]]:
        return [(document.nodes[each["node"]], dict(each["constraint"])) for each in content]

    for name in (*NODE_PARTS[version], "springBone", "constraints"):
        if not isinstance(avatar.get(name), str):
            continue
        try:
            content = _replaced(json.loads(avatar[name]), nodes.number, mesh)
            pairs = constrained(content) if name == "constraints" else []
        except (LookupError, TypeError, ValueError, RecursionError):
            message = "{part} of an avatar names a node that is not there, and is left out"
            found.append(finding("EXTENSION_DROPPED", version, message, name))
            continue
        if name == "springBone":
            document.extensions[_SPRINGS] = content
            used.add(_SPRINGS)
        elif name == "constraints":
            for node, constraint in pairs:
                node.extensions[_CONSTRAINT] = constraint
            used.add(_CONSTRAINT)
        else:
            document.extensions[version][name] = content
    document.extensionsUsed = sorted(used)
    return found


def _replaced(value: Any, node: Callable[[Any], Any], mesh: Callable[[Any], Any]) -> Any:
    """Return JSON with other names of nodes and meshes; -1, which is none, stays."""
    if isinstance(value, list):
        return [_replaced(v, node, mesh) for v in value]
    if not isinstance(value, Mapping):
        return value
    made = {}
    for key, held in value.items():
        if key in _NODES and _is_name(held):
            made[key] = node(held)
        elif key in _LISTS and isinstance(held, list):
            made[key] = [node(v) if _is_name(v) else v for v in held]
        elif key == "mesh" and _is_name(held):
            made[key] = mesh(held)
        else:
            made[key] = _replaced(held, node, mesh)
    return made


def _is_name(value: Any) -> bool:
    number = isinstance(value, int) and not isinstance(value, bool) and value >= 0
    return number or (isinstance(value, Mapping) and len(value) == 1)
