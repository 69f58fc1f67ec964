"""Meshes of a glTF file at rest, and their places by nodes and skins.

Source: glTF 2.0 specification, sections 3.7.2 (morph targets), 3.7.3 (skins).
"""

import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.certificate.stored_steps import HalfSteps
from usdface.io.gltf.reference_player.deformed_mesh import PlayerMesh, Sampled
from usdface.io.gltf.reference_player.gltf_file import PlayerFile
from usdface.io.gltf.reference_player.morph_targets import PlayerTargets, Target
from usdface.io.gltf.reference_player.node_motion import PlayerNodes, Space

if TYPE_CHECKING:
    from scipy.sparse import csr_array

__all__ = ["StillMesh", "read_mesh"]

PlaceMesh = Callable[[PlayerNodes], Space]


@dataclass(frozen=True, eq=False, slots=True)
class StillMesh:
    """A mesh that stands still, the nodes that would move it, and its space when nodes move."""

    mesh: PlayerMesh
    nodes: tuple[int, ...]
    space: PlaceMesh


@dataclass(frozen=True, eq=False, slots=True)
class _Block:
    """The `used` vertices of primitives that share them; `part` is the first of these.

    Normals are None where there are none, or where a target moves points but not normals.
    """

    part: dict[str, Any]
    used: IntArray
    points: FloatArray
    normals: FloatArray | None
    moves: PlayerTargets
    turns: PlayerTargets


def read_mesh(file: PlayerFile, node: int, still: PlayerNodes) -> StillMesh:
    """Return the mesh of a node, where no node moves."""
    n = file.json["nodes"][node]
    mesh = file.json["meshes"][n["mesh"]]
    parts = [p for p in mesh["primitives"] if p.get("mode", 4) in (4, 5, 6)]
    # Primitives that share their vertices are one; only used vertices are shown.
    blocks: dict[str, tuple[dict[str, Any], list[IntArray]]] = {}
    for part in parts:
        key = json.dumps([part["attributes"], part.get("targets", [])], sort_keys=True)
        used = file.json["accessors"][part["attributes"]["POSITION"]]["count"]
        corners = (
            file.accessor(part["indices"])[:, 0].astype(np.int64)
            if "indices" in part
            else np.arange(used)
        )
        blocks.setdefault(key, (part, []))[1].append(corners)
    read = [_block(file, p, np.unique(np.concatenate(c))) for p, c in blocks.values()]
    count = max((len(b.moves.targets) for b in read), default=0)
    extras = mesh.get("extras") or {}
    names = (extras.get("usdface") or {}).get("names") or _target_names(file, n, mesh)
    targets = tuple(str(names[k]) if k < len(names) else f"target_{k}" for k in range(count))
    rest = n.get("weights") or mesh.get("weights") or [0.0] * count
    points = np.concatenate([np.zeros((0, 3)), *(b.points for b in read)])
    normals = None
    if all(b.normals is not None for b in read):
        normals = np.concatenate([np.zeros((0, 3)), *(b.normals for b in read)])
    nodes, space = _placed(file, node, read)
    shown = PlayerMesh(
        name=n.get("name") or mesh.get("name") or "Mesh",
        targets=targets,
        points=points,
        normals=normals,
        moves=PlayerTargets.side_by_side([b.moves for b in read], count),
        turns=PlayerTargets.side_by_side([b.turns for b in read], count),
        weights=Sampled(np.zeros(1), np.array([rest], np.float64).reshape(1, count)),
        inbetweens=_inbetweens(mesh.get("extras"), targets),
        space=space(still),
        halves=_half_steps(file, [b.part for b in read], count),
    )
    return StillMesh(shown, nodes, space)


def _target_names(file: PlayerFile, node: dict[str, Any], mesh: dict[str, Any]) -> list[Any]:
    """Return the names of a mesh's targets: by it, its primitives, its node, its accessors."""
    primitives = mesh["primitives"]
    for holder in (mesh, *primitives, node):
        if names := (holder.get("extras") or {}).get("targetNames"):
            return list(names)
    targets = primitives[0].get("targets", []) if primitives else []
    held = [file.json["accessors"][t["POSITION"]] for t in targets if "POSITION" in t]
    names = [accessor.get("name") or "" for accessor in held]
    return names if all(names) and len({*names}) == len(targets) else []


def _block(file: PlayerFile, part: dict[str, Any], used: IntArray) -> _Block:
    at = part["attributes"]
    points = file.accessor(at["POSITION"])[used].astype(np.float64)

    def target(stored: dict[str, Any], attribute: str) -> Target:
        if attribute not in stored:
            return Target.of(np.zeros((0, 3), np.float32))
        return Target.of(file.accessor(stored[attribute])[used].astype(np.float32))

    def targets(attribute: str) -> PlayerTargets:
        stored = part.get("targets", [])
        return PlayerTargets(len(used), tuple(target(one, attribute) for one in stored))

    lit = "NORMAL" in at and all("NORMAL" in t for t in part.get("targets", []))
    normals = file.accessor(at["NORMAL"])[used].astype(float) if lit else None
    return _Block(part, used, points, normals, targets("POSITION"), targets("NORMAL"))


def _half_steps(file: PlayerFile, parts: list[dict[str, Any]], count: int) -> HalfSteps | None:
    """Return the half-steps of a mesh with `count` targets; None where all are floats."""

    def largest(attribute: str, stored: list[dict[str, Any]]) -> float:
        given = (part[attribute] for part in stored if attribute in part)
        return max(map(file.half_step, given), default=0.0)

    whole = [part["attributes"] for part in parts]
    targets = [
        [part["targets"][k] for part in parts if k < len(part.get("targets", []))]
        for k in range(count)
    ]
    halves = HalfSteps(
        largest("POSITION", whole),
        largest("NORMAL", whole),
        np.array([largest("POSITION", stored) for stored in targets]),
        np.array([largest("NORMAL", stored) for stored in targets]),
    )
    return halves if halves.any else None


def _placed(file: PlayerFile, node: int, read: list[_Block]) -> tuple[tuple[int, ...], PlaceMesh]:
    """Return the nodes that place a mesh, and how."""
    n = file.json["nodes"][node]
    if "skin" not in n or not all("JOINTS_0" in b.part["attributes"] for b in read):
        return (node,), lambda nodes: nodes.of_node(node)
    skin = file.json["skins"][n["skin"]]
    joints = tuple(skin["joints"])
    inverse = np.tile(np.eye(4), (len(joints), 1, 1))
    if "inverseBindMatrices" in skin:
        stored = file.accessor(skin["inverseBindMatrices"]).astype(np.float64)
        inverse = stored.reshape(-1, 4, 4).swapaxes(1, 2)[: len(joints)]  # columns come first
    weights = _influences(file, read, len(joints))
    return joints, lambda nodes: nodes.of_skin(joints, inverse, weights)


def _influences(file: PlayerFile, read: list[_Block], joint_count: int) -> "csr_array":
    """Return the influences of joints on vertices, (N, J), which sum up to 1 for each vertex.

    As programs make them on loading; vertices without influences go to the first joint.
    """
    from scipy.sparse import csr_array  # only skins need it

    rows, columns, values = [], [], []
    start = 0
    for block in read:
        own = np.arange(start, start + len(block.used))
        start += len(block.used)
        attributes, number = block.part["attributes"], 0
        while f"JOINTS_{number}" in attributes:
            influences = file.accessor(attributes[f"JOINTS_{number}"])[block.used]
            weights = file.accessor(attributes[f"WEIGHTS_{number}"])[block.used]
            rows.append(np.repeat(own, influences.shape[1]))
            columns.append(influences.ravel().astype(np.int64))
            values.append(weights.ravel().astype(np.float64))
            number += 1
    held = np.concatenate(values).clip(min=0), (np.concatenate(rows), np.concatenate(columns))
    weights = csr_array(held, shape=(start, joint_count))
    total = np.bincount(held[1][0], held[0], start)
    if not total.all():
        alone, first = np.unique(held[1][0], return_index=True)
        lost = first[total[alone] == 0]
        places = (held[1][0][lost], held[1][1][lost])
        weights = weights + csr_array((np.ones(len(lost)), places), shape=weights.shape)
        total = np.where(total == 0, 1.0, total)
    return weights.multiply(1 / total[:, None]).tocsr()


def _inbetweens(extras: Any, targets: tuple[str, ...]) -> tuple[tuple[int, int, float], ...]:
    notes = ((extras or {}).get("usdface") or {}).get("inbetweens") or []
    return tuple(
        (targets.index(note["target"]), targets.index(note["shape"]), float(note["weight"]))
        for note in notes
    )
