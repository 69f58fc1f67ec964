"""Avatars in VRM: who may use them, which joint is which, and expressions, there and back.

Nodes, meshes and morph targets are numbers in a VRM file and names here, in the extras of the file
under ``vrm``, so that the numbers of another file can be made of them.

Source: VRM 0.x and VRMC_vrm 1.0 specifications (meta, humanoid, expressions; blendShapeMaster).
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from pygltflib import GLTF2

from usdface.findings import Finding, finding
from usdface.io.gltf.vrm_nodes import NODE_PARTS
from usdface.rigs import Mesh

__all__ = ["VRM", "VRM_NAMES", "read_vrm", "vrm_extension"]

VRM = "vrm"  # the key among the extras of a file
VRM_NAMES = ("VRM", "VRMC_vrm")  # extensions of the versions 0 and 1
_KEPT = {"VRM": {"meta", "humanoid", "blendShapeMaster", "specVersion", "exporterVersion"}}
_KEPT["VRMC_vrm"] = {"meta", "humanoid", "expressions", "specVersion"}
_PERCENT = 100.0  # of a weight in version 0
_SETTINGS = ("isBinary", "overrideBlink", "overrideLookAt", "overrideMouth")


def read_vrm(
    document: GLTF2, meshes: Mapping[int, Mesh], joints: Mapping[int, str]
) -> tuple[dict[str, Any], list[Finding]]:
    """Return the avatar of a document as JSON values; {} where it is none.

    Parameters
    ----------
    document : pygltflib.GLTF2
    meshes : mapping of int to Mesh
        By the node that carries each.
    joints : mapping of int to str
        Path of the joint of a node.

    Returns
    -------
    dict
        ``version``, ``meta``, ``humanoid`` (joint paths by bone), ``expressions``: by name
        ``preset``, ``weights`` (by mesh and blend shape) and settings.
    list of Finding
        EXTENSION_DROPPED for the parts that are not kept.
    """
    given = document.extensions or {}
    name = next((name for name in reversed(VRM_NAMES) if isinstance(given.get(name), Mapping)), "")
    if not name:
        return {}, []
    source = given[name]
    lost = sorted(set(source) - _KEPT[name] - {*NODE_PARTS[name]})
    version = str(source.get("specVersion", "1.0")) if name == "VRMC_vrm" else "0.0"
    made: dict[str, Any] = {"version": version}
    if isinstance(source.get("meta"), Mapping):
        made["meta"] = {k: v for k, v in source["meta"].items() if k not in _IMAGES}
        lost += sorted(set(source["meta"]) & _IMAGES)
    bones = dict(_bones(source.get("humanoid")))
    made["humanoid"] = {bone: joints[node] for bone, node in bones.items() if node in joints}
    found = _lost_bones(name, bones, made["humanoid"])
    expressions = {}
    for label, expression, binds in _expressions(source, document):
        weights: dict[str, dict[str, float]] = {}
        for node, place, weight in binds:
            mesh = meshes.get(node)
            if mesh is not None and 0 <= place < len(mesh.shapes):
                weights.setdefault(mesh.name, {})[mesh.shapes[place].name] = weight
        expressions[label] = expression | ({"weights": weights} if weights else {})
    if expressions:
        made["expressions"] = expressions
    if not lost:
        return made, found
    message = "{parts} of {extension} are left out; expressions, bones and meta are kept"
    return made, [*found, finding("EXTENSION_DROPPED", name, message, lost, name)]


def _lost_bones(name: str, bones: Mapping[str, Any], kept: Mapping[str, Any]) -> list[Finding]:
    """Return EXTENSION_DROPPED for bones of an avatar whose node is no joint."""
    lost = sorted(set(bones) - set(kept))
    message = "{parts} of {extension} are left out: the bones are no joints that move a mesh"
    return [finding("EXTENSION_DROPPED", name, message, lost, name)] if lost else []


_IMAGES = {"thumbnailImage", "texture"}  # numbers of images, which mean nothing elsewhere


def _bones(humanoid: Any) -> Iterator[tuple[str, int]]:
    bones = humanoid.get("humanBones") if isinstance(humanoid, Mapping) else None
    if isinstance(bones, Mapping):
        pairs = [(name, bone) for name, bone in bones.items()]
    else:
        listed = bones if isinstance(bones, list) else []
        pairs = [(bone.get("bone"), bone) for bone in listed if isinstance(bone, Mapping)]
    for name, bone in pairs:
        if isinstance(name, str) and isinstance(bone, Mapping) and type(bone.get("node")) is int:
            yield name, bone["node"]


def _expressions(
    source: Mapping[str, Any], document: GLTF2
) -> Iterator[tuple[str, dict[str, Any], list[tuple[int, int, float]]]]:
    """Yield name, settings, and (node, target, weight) of each expression."""
    for kind, group in (source.get("expressions") or {}).items():
        for name, expression in group.items() if isinstance(group, Mapping) else ():
            kept = {key: expression[key] for key in _SETTINGS if key in expression}
            binds = expression.get("morphTargetBinds") or []
            rows = [(b["node"], b["index"], float(b["weight"])) for b in binds]
            yield name, {"preset": name if kind == "preset" else ""} | kept, rows
    master = source.get("blendShapeMaster") or {}
    for group in master.get("blendShapeGroups") or []:
        carriers: list[tuple[int, int, float]] = []
        for bind in group.get("binds") or []:
            nodes = [k for k, n in enumerate(document.nodes or []) if n.mesh == bind["mesh"]]
            carriers += [(n, bind["index"], float(bind["weight"]) / _PERCENT) for n in nodes]
        preset = str(group.get("presetName") or "")
        kept = {key: group[key] for key in _SETTINGS if key in group}
        yield str(group.get("name") or preset), {"preset": preset} | kept, carriers


def vrm_extension(
    avatar: Mapping[str, Any],
    carriers: Sequence[tuple[int, Mesh]],
    joints: Mapping[str, int],
    document: GLTF2,
) -> tuple[str, dict[str, Any], list[Finding]]:
    """Return the extension's name and content for the nodes of a new document.

    Bones whose joint is not there are left out (EXTENSION_DROPPED).

    Parameters
    ----------
    avatar : mapping
        As `read_vrm` returns it.
    carriers : sequence of (int, Mesh)
        Node of each mesh.
    joints : mapping of str to int
        Node of each joint.
    document : pygltflib.GLTF2
    """
    old = str(avatar.get("version", "1.0")).startswith("0")
    named = _dict(avatar, "humanoid")
    bones = {bone: joints[path] for bone, path in named.items() if path in joints}
    found = _lost_bones("VRM" if old else "VRMC_vrm", named, bones)
    groups = []
    for name, expression in _dict(avatar, "expressions").items():
        binds = []
        for node, mesh in carriers:
            weights = _dict(_dict(expression, "weights"), mesh.name)
            for place, shape in enumerate(mesh.shape_names):
                if shape in weights:
                    binds.append((node, place, float(weights[shape])))
        kept = {key: expression[key] for key in _SETTINGS if key in expression}
        groups.append((name, str(expression.get("preset", "")), kept, binds))
    meta = dict(_dict(avatar, "meta"))
    if old:
        content = {
            "specVersion": "0.0",
            "meta": meta,
            "humanoid": {"humanBones": [{"bone": b, "node": n} for b, n in bones.items()]},
            "blendShapeMaster": {
                "blendShapeGroups": [
                    {"name": name, "presetName": preset}
                    | kept
                    | {"binds": [_old_bind(document, *bind) for bind in binds]}
                    for name, preset, kept, binds in groups
                ]
            },
        }
        return "VRM", content, found
    kinds: dict[str, dict[str, Any]] = {}
    for name, preset, kept, binds in groups:
        rows = [{"node": node, "index": place, "weight": w} for node, place, w in binds]
        kind = "preset" if preset else "custom"
        kinds.setdefault(kind, {})[name] = kept | ({"morphTargetBinds": rows} if rows else {})
    made = {
        "specVersion": str(avatar.get("version", "1.0")),
        "meta": meta,
        "humanoid": {"humanBones": {bone: {"node": node} for bone, node in bones.items()}},
    }
    return "VRMC_vrm", made | ({"expressions": kinds} if kinds else {}), found


def _old_bind(document: GLTF2, node: int, place: int, weight: float) -> dict[str, Any]:
    mesh = document.nodes[node].mesh
    return {"mesh": mesh, "index": place, "weight": weight * _PERCENT}


def _dict(values: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    found = values.get(key)
    return found if isinstance(found, Mapping) else {}
