"""Evaluation of a glTF file, which shares no code with the reader and the writer.

It takes the written bytes apart with json and struct, so that a certificate
(`usdface.certificate`) does not repeat the mistakes it should find.

Source: glTF 2.0 specification, sections 3.5 (node transforms), 3.6.2 (accessors), 3.7.2 (morph
targets), 3.7.3 (skins), 3.11 (animations), appendix C (interpolation).
"""

import struct
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from usdface.arrays import FloatArray
from usdface.errors import InputError
from usdface.io.gltf.reference_player.deformed_mesh import PlayerMesh, Sampled
from usdface.io.gltf.reference_player.gltf_file import PlayerFile
from usdface.io.gltf.reference_player.node_motion import PlayerNodes
from usdface.io.gltf.reference_player.still_meshes import StillMesh, read_mesh

__all__ = ["PlayerClip", "evaluate_clips"]

# Raised by JSON of the wrong form.
_BROKEN = (
    *(ArithmeticError, AttributeError, LookupError, OSError, TypeError, ValueError),
    struct.error,
)
_TRANSFORMS = ("translation", "rotation", "scale")


@dataclass(frozen=True, eq=False, slots=True)
class PlayerClip:
    """The meshes of a file in one animation; `times` (K,) [s] are all of its keys.

    `cubic` tells whether anything moves along curves between them, `decoded` whether our own
    decoder had a part in it.
    """

    name: str
    meshes: tuple[PlayerMesh, ...]
    times: FloatArray
    cubic: bool
    decoded: bool = False


def evaluate_clips(path: Path, asset_root: Path | None = None) -> tuple[PlayerClip, ...]:
    """Take a .glb or .gltf apart into the meshes of its default scene, for each animation.

    Animations that move nothing that is shown are left out; without any there is one clip, in
    which all stands still.

    Raises
    ------
    InputError
        If it uses features that this evaluator does not support, or is malformed.
    """
    try:
        return _Scene(path, asset_root).clips()
    except _BROKEN as error:
        raise InputError(f"{path} cannot be evaluated: {error}") from error
    except RecursionError as error:
        raise InputError(f"{path} cannot be evaluated: its nodes form a ring") from error


class _Scene(PlayerFile):
    """The default scene of one file."""

    def clips(self) -> tuple[PlayerClip, ...]:
        self.instances: dict[int, int] = {}  # the node that each instance is of
        nodes = self.json.get("nodes", [])
        self._expand(nodes)
        parents = self._parents(nodes)
        still = PlayerNodes(nodes, parents, {})
        meshes = [
            (n, read_mesh(self, n, still)) for n in parents if nodes[n].get("mesh") is not None
        ]
        meshes = [(node, part) for node, part in meshes if len(part.mesh.points)]
        clips = []
        for number, animation in enumerate(self.json.get("animations", [])):
            name = str(animation.get("name") or f"animation {number}")
            clip = self._clip(name, self._curves(animation), still, meshes)
            clips += [clip] if len(clip.times) else []
        return tuple(clips) or (self._clip("", {}, still, meshes),)

    def _expand(self, nodes: list[dict[str, Any]]) -> None:
        """Give each instance of a mesh a node of its own (EXT_mesh_gpu_instancing)."""
        for index, node in enumerate(list(nodes)):
            given = node.get("extensions", {}).get("EXT_mesh_gpu_instancing", {}).get("attributes")
            if not given or "mesh" not in node or "skin" in node:
                continue
            rows = {key.lower(): self.accessor(given[key]) for key in given if key[0] != "_"}
            own = {k: node[k] for k in ("name", "mesh", "weights") if k in node}
            first = len(nodes)
            for parts in zip(*rows.values(), strict=True):
                self.instances[len(nodes)] = index
                nodes.append(own | {k: v.tolist() for k, v in zip(rows, parts, strict=True)})
            node["children"] = [*node.get("children", []), *range(first, len(nodes))]
            del node["mesh"]

    def _parents(self, nodes: list[dict[str, Any]]) -> dict[int, int]:
        """Return the parent of each node of the scene, parents first."""
        children = {child for node in nodes for child in node.get("children", [])}
        roots = [k for k in range(len(nodes)) if k not in children]
        scenes = self.json.get("scenes", [])
        if scenes:
            roots = scenes[self.json.get("scene", 0)].get("nodes", [])
        parents: dict[int, int] = {}

        def visit(index: int, above: int) -> None:
            if index in parents:
                raise ValueError("its nodes form a ring, or have two parents")
            parents[index] = above
            for child in nodes[index].get("children", []):
                visit(child, index)

        for root in roots:
            if root not in parents:
                visit(root, -1)
        return parents

    def _curves(self, animation: dict[str, Any]) -> dict[tuple[int, str], Sampled]:
        """Return the samplers of an animation by ``(node, path)`` or ``(node, "weights/3")``."""
        curves: dict[tuple[int, str], Sampled] = {}
        for channel in animation.get("channels", []):
            target = channel["target"]
            sampler = animation["samplers"][channel["sampler"]]
            if target["path"] != "pointer":
                places = [(target.get("node", -1), target["path"])]
            else:
                pointer = target["extensions"]["KHR_animation_pointer"]["pointer"]
                places = self._pointed(pointer)
            for place in places:
                curves[place] = self._sampled(sampler, place[1])
        return curves

    def _pointed(self, pointer: str) -> list[tuple[int, str]]:
        _, kind, index, *rest = pointer.split("/")
        if kind == "nodes":
            return [(int(index), "/".join(rest))]
        if kind != "meshes" or rest[:1] != ["weights"]:
            return []
        nodes = self.json.get("nodes", [])
        mesh = int(index)
        users = [k for k, n in enumerate(nodes) if n.get("mesh") == mesh and not n.get("weights")]
        return [(user, "/".join(rest)) for user in users]

    def _sampled(self, sampler: dict[str, Any], path: str) -> Sampled:
        kind = str(sampler.get("interpolation", "LINEAR"))
        times = self.accessor(sampler["input"])[:, 0].astype(np.float64)
        values = self.accessor(sampler["output"]).astype(np.float64)
        values = values.reshape(len(times), *([3] if kind == "CUBICSPLINE" else []), -1)
        return Sampled(times, values, kind, path == "rotation")

    def _clip(
        self,
        name: str,
        curves: dict[tuple[int, str], Sampled],
        still: PlayerNodes,
        meshes: list[tuple[int, StillMesh]],
    ) -> PlayerClip:
        transforms = {place: c for place, c in curves.items() if place[1] in _TRANSFORMS}
        moving = PlayerNodes(still.nodes, still.parents, transforms)
        used: list[Sampled] = []
        shown = []
        for node, part in meshes:
            weights = part.mesh.weights
            of = (node, self.instances.get(node))
            own = {p: c for (n, p), c in curves.items() if n in of and p.startswith("weights")}
            if own and part.mesh.targets:
                weights = _weighted(own, weights)
                used += own.values()
            chains = {a for n in part.nodes for a in _chain(n, still.parents)}
            used += [curve for (n, _), curve in transforms.items() if n in chains]
            shown.append(replace(part.mesh, weights=weights, space=part.space(moving)))
        times = np.unique(np.concatenate([np.zeros(0), *(curve.times for curve in used)]))
        cubic = any(curve.interpolation == "CUBICSPLINE" for curve in used)
        return PlayerClip(name, tuple(shown), times, cubic, self.decoded)


@dataclass(frozen=True, eq=False, slots=True)
class _Columns(Sampled):
    """Weights of which some have curves of their own."""

    single: Mapping[int, Sampled] = field(default_factory=dict)

    def at(self, times: FloatArray) -> FloatArray:
        values = Sampled(self.times, self.values, self.interpolation).at(times).copy()
        for column, curve in self.single.items():
            values[:, column] = curve.at(times)[:, 0]
        return values


def _weighted(curves: dict[str, Sampled], rest: Sampled) -> Sampled:
    """Return the weights of a mesh; pointers to some of them go over those to all."""
    whole = curves.get("weights", rest)
    single = {int(path.partition("/")[2]): c for path, c in curves.items() if path != "weights"}
    if not single:
        return whole
    return _Columns(whole.times, whole.values, whole.interpolation, False, single)


def _chain(node: int, parents: Mapping[int, int]) -> list[int]:
    chain = []
    while node >= 0:
        chain.append(node)
        node = parents[node]
    return chain
