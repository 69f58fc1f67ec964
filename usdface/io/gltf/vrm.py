"""Avatars in VRM: who may use them, which joint is which, and expressions, there and back.

Nodes, meshes and morph targets are numbers in a VRM file and names here, in the extras of the file
under ``vrm``, so that the numbers of another file can be made of them. Of meshes or expressions
that share a name, those after the first are numbered.

Source: VRM 0.x and VRMC_vrm 1.0 specifications (meta, humanoid, expressions; blendShapeMaster).
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from pygltflib import GLTF2

from usdface.findings import Finding, finding
from usdface.io.gltf.vrm_nodes import NODE_PARTS, mesh_numbers
from usdface.io.unique_name import unique_name
from usdface.rigs import Mesh

__all__ = ["VRM", "VRM_NAMES", "read_vrm", "vrm_extension"]

VRM = "vrm"  # the key among the extras of a file
VRM_NAMES = ("VRM", "VRMC_vrm")  # extensions of the versions 0 and 1
_KEPT = {"VRM": {"meta", "humanoid", "blendShapeMaster", "specVersion", "exporterVersion"}}
_KEPT["VRMC_vrm"] = {"meta", "humanoid", "expressions", "specVersion"}
_PERCENT = 100.0  # of a weight in version 0
_SETTINGS = ("isBinary", "overrideBlink", "overrideLookAt", "overrideMouth")
_READ = {*_SETTINGS, "name", "presetName", "binds", "morphTargetBinds"}  # of an expression
_READ_OF_BONES = {"bone", "node", "useDefaultValues"}


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
        ``preset``, ``weights`` (by mesh and blend shape), settings, and ``name`` where another
        one has it, too.
    list of Finding
        EXTENSION_DROPPED for the parts that are not kept.
    """
    given = document.extensions or {}
    name = next((name for name in reversed(VRM_NAMES) if isinstance(given.get(name), Mapping)), "")
    if not name:
        return {}, []
    source = given[name]
    lost = set(source) - _KEPT[name] - {*NODE_PARTS[name]}
    version = str(source.get("specVersion", "1.0")) if name == "VRMC_vrm" else "0.0"
    made: dict[str, Any] = {"version": version}
    if isinstance(source.get("meta"), Mapping):
        made["meta"] = {k: v for k, v in source["meta"].items() if k not in _IMAGES}
        lost |= set(source["meta"]) & _IMAGES
    lost |= _unread_of_humanoid(source.get("humanoid"))
    bones = dict(_bones(source.get("humanoid")))
    made["humanoid"] = {bone: joints[node] for bone, node in bones.items() if node in joints}
    found = _lost_bones(name, bones, made["humanoid"])
    expressions: dict[str, Any] = {}
    unbound = []
    labels = {node: label for label, node in mesh_numbers(meshes.items()).items()}
    for label, expression, binds, unread in _expressions(source, meshes, document):
        key = unique_name(label, expressions)
        named = {"name": label} if key != label else {}
        weights: dict[str, dict[str, float]] = {}
        for node, place, weight in binds:
            shapes = meshes[node].shapes if node in meshes else ()
            if 0 <= place < len(shapes):
                weights.setdefault(labels[node], {})[shapes[place].name] = weight
            elif weight:
                unbound.append(key)
        expressions[key] = expression | named | ({"weights": weights} if weights else {})
        lost |= unread
    if expressions:
        made["expressions"] = expressions
    found += _lost_binds(name, unbound)
    if not lost:
        return made, found
    message = "{parts} of {extension} are left out; expressions, bones and meta are kept"
    return made, [*found, finding("EXTENSION_DROPPED", name, message, sorted(lost), name)]


def _lost_bones(name: str, bones: Mapping[str, Any], kept: Mapping[str, Any]) -> list[Finding]:
    """Return EXTENSION_DROPPED for bones of an avatar whose node is no joint."""
    lost = sorted(set(bones) - set(kept))
    message = "{parts} of {extension} are left out: the bones are no joints that move a mesh"
    return [finding("EXTENSION_DROPPED", name, message, lost, name)] if lost else []


def _lost_binds(name: str, expressions: Sequence[str]) -> list[Finding]:
    """Return EXTENSION_DROPPED for expressions that name morph targets which are not there."""
    message = "binds of {parts} in {extension} are left out: their morph targets are not there"
    lost = sorted({*expressions})
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


def _unread_of_humanoid(humanoid: Any) -> set[str]:
    """Return the settings of bones and muscles, but for the node of each bone."""
    if not isinstance(humanoid, Mapping):
        return set()
    bones = humanoid.get("humanBones")
    listed = bones.values() if isinstance(bones, Mapping) else bones
    each = [bone for bone in listed or [] if isinstance(bone, Mapping)]
    return set(humanoid) - {"humanBones"} | {key for bone in each for key in bone} - _READ_OF_BONES


def _expressions(
    source: Mapping[str, Any], meshes: Iterable[int], document: GLTF2
) -> Iterator[tuple[str, dict[str, Any], list[tuple[int, int, float]], set[str]]]:
    """Yield name, settings, (node, target, weight) of each expression, and its other contents."""
    for kind, group in (source.get("expressions") or {}).items():
        for name, expression in group.items() if isinstance(group, Mapping) else ():
            kept = {key: expression[key] for key in _SETTINGS if key in expression}
            binds = expression.get("morphTargetBinds") or []
            rows = [(b["node"], b["index"], float(b["weight"])) for b in binds]
            settings = {"preset": name if kind == "preset" else ""} | kept
            yield name, settings, rows, _unread(expression)
    master = source.get("blendShapeMaster") or {}
    for group in master.get("blendShapeGroups") or []:
        carriers: list[tuple[int, int, float]] = []
        for bind in group.get("binds") or []:
            nodes = [n for n in meshes if document.nodes[n].mesh == bind["mesh"]] or [-1]
            carriers += [(n, bind["index"], float(bind["weight"]) / _PERCENT) for n in nodes]
        preset = str(group.get("presetName") or "")
        kept = {key: group[key] for key in _SETTINGS if key in group}
        name = str(group.get("name") or preset)
        yield name, {"preset": preset} | kept, carriers, _unread(group)


def _unread(expression: Mapping[str, Any]) -> set[str]:
    """Return the keys of an expression that hold something else, as changes of materials."""
    return {key for key, value in expression.items() if value and key not in _READ}


def vrm_extension(
    avatar: Mapping[str, Any],
    carriers: Sequence[tuple[int, Mesh]],
    joints: Mapping[str, int],
    document: GLTF2,
) -> tuple[str, dict[str, Any], list[Finding]]:
    """Return the extension's name and content for the nodes of a new document.

    Bones whose joint is not there are left out (EXTENSION_DROPPED), and so are blend shapes.

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
    groups, unbound = [], []
    meshes = dict(carriers)
    numbers = mesh_numbers(carriers)
    for key, expression in _dict(avatar, "expressions").items():
        binds = []
        for label in _dict(expression, "weights"):
            shapes = meshes[numbers[label]].shape_names if label in numbers else ()
            for shape, weight in _dict(_dict(expression, "weights"), label).items():
                if shape in shapes:
                    binds.append((numbers[label], shapes.index(shape), float(weight)))
                else:
                    unbound.append(key)
        kept = {each: expression[each] for each in _SETTINGS if each in expression}
        name = str(expression.get("name", key))
        groups.append((name, str(expression.get("preset", "")), kept, sorted(binds)))
    found += _lost_binds("VRM" if old else "VRMC_vrm", unbound)
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
