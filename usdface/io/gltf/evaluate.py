"""What a glTF file shows: an evaluator that shares nothing with our reader and writer.

It takes the written bytes apart with json and struct, so that a certificate
(`usdface.certificate`) does not repeat the mistakes it should find.

Source: glTF 2.0 specification, sections 3.5 (node transforms), 3.6.2 (accessors), 3.7.2 (morph
targets), 3.7.3 (skins), 3.11 (animations), appendix C (interpolation).
"""

import base64
import json
import struct
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from usdface.errors import InputError
from usdface.io.gltf.shown import ShownMesh
from usdface.takes import FloatArray, IntArray

__all__ = ["evaluate_gltf"]

_DTYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
_BROKEN = (
    ArithmeticError,
    AttributeError,
    LookupError,
    OSError,
    TypeError,
    ValueError,
    struct.error,
)  # what a JSON of the wrong form ends in
_MOST_NUMBERS = 2**28  # in the morph targets of one file


def evaluate_gltf(path: Path) -> tuple[ShownMesh, ...]:
    """Take a .glb or .gltf apart into the meshes of its default scene, in scene order.

    Raises
    ------
    InputError
        If it uses what this evaluator does not know, or is broken.
    """
    try:
        return _File(path).meshes()
    except _BROKEN as error:
        raise InputError(f"{path} cannot be evaluated: {error}") from error
    except RecursionError as error:
        raise InputError(f"{path} cannot be evaluated: its nodes form a ring") from error


class _File:
    """JSON and buffers of one file."""

    def __init__(self, path: Path) -> None:
        data = path.read_bytes()
        chunk: bytes | None = None
        if data[:4] == b"glTF":
            size = struct.unpack_from("<I", data, 12)[0]
            text, chunk = data[20 : 20 + size], data[28 + size :]
        else:
            text = data
        self.json: dict[str, Any] = json.loads(text)
        if unknown := set(self.json.get("extensionsRequired", [])) - {"KHR_mesh_quantization"}:
            raise InputError(f"{path} cannot be evaluated: it needs {', '.join(sorted(unknown))}")
        self.buffers = [
            self._buffer(buffer, path, chunk) for buffer in self.json.get("buffers", [])
        ]
        self.budget = _MOST_NUMBERS

    @staticmethod
    def _buffer(buffer: dict[str, Any], path: Path, chunk: bytes | None) -> bytes:
        uri = buffer.get("uri")
        if uri is None:
            return chunk or b""
        if uri.startswith("data:"):
            return base64.b64decode(uri.partition(",")[2])
        beside = (path.parent / unquote(uri)).resolve()
        if not beside.is_relative_to(path.parent.resolve()):
            raise ValueError(f"{uri} is outside the folder of the file")
        return beside.read_bytes()

    def _rows(self, view: int, offset: int, dtype: str, shape: tuple[int, int]) -> NDArray[Any]:
        v = self.json["bufferViews"][view]
        size = np.dtype(dtype).itemsize
        start, stride = v.get("byteOffset", 0), v.get("byteStride") or shape[1] * size
        data = memoryview(self.buffers[v["buffer"]])[start : start + v["byteLength"]]
        return np.ndarray(shape, dtype, data, offset, (stride, size))

    def accessor(self, index: int) -> NDArray[Any]:
        a = self.json["accessors"][index]
        dtype, shape = _DTYPES[a["componentType"]], (a["count"], _WIDTHS[a["type"]])
        self.budget -= shape[0] * shape[1]
        if self.budget < 0:
            raise ValueError("it unfolds into too many numbers")
        values = np.zeros(shape, dtype)
        if "bufferView" in a:
            values[:] = self._rows(a["bufferView"], a.get("byteOffset", 0), dtype, shape)
        if "sparse" in a:
            s, count = a["sparse"], a["sparse"]["count"]
            where, what = s["indices"], s["values"]
            kind = _DTYPES[where["componentType"]]
            place = self._rows(where["bufferView"], where.get("byteOffset", 0), kind, (count, 1))
            values[place[:, 0]] = self._rows(
                what["bufferView"], what.get("byteOffset", 0), dtype, (count, shape[1])
            )
        if a.get("normalized") and dtype != "<f4":
            return np.maximum(values / np.float64(np.iinfo(dtype).max), -1.0)
        return values

    def meshes(self) -> tuple[ShownMesh, ...]:
        nodes = self.json.get("nodes", [])
        scenes = self.json.get("scenes", [])
        children = {child for node in nodes for child in node.get("children", [])}
        roots = [k for k in range(len(nodes)) if k not in children]
        if scenes:
            roots = scenes[self.json.get("scene", 0)].get("nodes", [])
        worlds: dict[int, FloatArray] = {}

        def visit(index: int, above: FloatArray) -> None:
            worlds[index] = above @ _local(nodes[index])
            for child in nodes[index].get("children", []):
                visit(child, worlds[index])

        for root in roots:
            if root not in worlds:
                visit(root, np.eye(4))
        shown = [self._mesh(n, worlds) for n in worlds if nodes[n].get("mesh") is not None]
        return tuple(mesh for mesh in shown if len(mesh.points))

    def _mesh(self, node: int, worlds: dict[int, FloatArray]) -> ShownMesh:
        n = self.json["nodes"][node]
        mesh = self.json["meshes"][n["mesh"]]
        parts = [p for p in mesh["primitives"] if p.get("mode", 4) in (4, 5, 6)]
        # Primitives that share their vertices are one; only used vertices are shown.
        blocks: dict[str, tuple[dict[str, Any], list[IntArray]]] = {}
        for part in parts:
            key = json.dumps([part["attributes"], part.get("targets", [])], sort_keys=True)
            used = self.json["accessors"][part["attributes"]["POSITION"]]["count"]
            corners = (
                self.accessor(part["indices"])[:, 0].astype(np.int64)
                if "indices" in part
                else np.arange(used)
            )
            blocks.setdefault(key, (part, []))[1].append(corners)
        read = [self._block(p, np.unique(np.concatenate(c))) for p, c in blocks.values()]
        count = max((len(b["moves"]) for b in read), default=0)
        names = (mesh.get("extras") or {}).get("targetNames") or []
        targets = tuple(str(names[k]) if k < len(names) else f"target_{k}" for k in range(count))
        rest = n.get("weights") or mesh.get("weights") or [0.0] * count
        times, weights, interpolation = self._animated(node, count, np.array([rest], np.float64))
        points = np.concatenate([np.zeros((0, 3)), *(b["points"] for b in read)])
        normals = None
        if all(b["normals"] is not None for b in read):
            normals = np.concatenate([np.zeros((0, 3)), *(b["normals"] for b in read)])
        empty = np.zeros((count, 0, 3), np.float32)
        return ShownMesh(
            n.get("name") or mesh.get("name") or "Mesh",
            targets,
            points,
            normals,
            np.concatenate([empty, *(b["moves"] for b in read)], 1),
            np.concatenate([empty, *(b["turns"] for b in read)], 1),
            times,
            weights,
            interpolation,
            _inbetweens(mesh.get("extras"), targets),
            *self._placed(n, worlds, worlds[node], read),
        )

    def _block(self, part: dict[str, Any], used: IntArray) -> dict[str, Any]:
        at = part["attributes"]
        points = self.accessor(at["POSITION"])[used].astype(np.float64)

        def targets(what: str) -> NDArray[np.float32]:
            parts = part.get("targets", [])
            result = np.zeros((len(parts), len(used), 3), np.float32)
            for row, target in zip(result, parts, strict=True):
                if what in target:
                    row[:] = self.accessor(target[what])[used]
            return result

        lit = "NORMAL" in at and all("NORMAL" in t for t in part.get("targets", []))
        return {
            "points": points,
            "normals": self.accessor(at["NORMAL"])[used].astype(float) if lit else None,
            "moves": targets("POSITION"),
            "turns": targets("NORMAL"),
            "at": at,
            "used": used,
        }

    def _animated(
        self, node: int, count: int, rest: FloatArray
    ) -> tuple[FloatArray, FloatArray, str]:
        for channel in self._animation().get("channels", []):
            target = channel["target"]
            if target.get("node") == node and target["path"] == "weights":
                sampler = self._animation()["samplers"][channel["sampler"]]
                kind = str(sampler.get("interpolation", "LINEAR"))
                times = self.accessor(sampler["input"])[:, 0].astype(np.float64)
                values = self.accessor(sampler["output"]).astype(np.float64)
                shape = (len(times), 3, count) if kind == "CUBICSPLINE" else (len(times), count)
                return times, values.reshape(shape), kind
        return np.zeros(1), rest, "LINEAR"

    def _animation(self) -> dict[str, Any]:
        """Return the first animation that moves weights."""
        for animation in self.json.get("animations", []):
            if any(channel["target"]["path"] == "weights" for channel in animation["channels"]):
                return dict(animation)
        return {}

    def _placed(
        self,
        node: dict[str, Any],
        worlds: dict[int, FloatArray],
        world: FloatArray,
        read: list[dict[str, Any]],
    ) -> tuple[FloatArray, FloatArray]:
        if "skin" not in node or not all("JOINTS_0" in b["at"] for b in read):
            return world, _turning(world)
        skin = self.json["skins"][node["skin"]]
        inverse = np.tile(np.eye(4), (len(skin["joints"]), 1, 1))
        if "inverseBindMatrices" in skin:
            stored = self.accessor(skin["inverseBindMatrices"]).astype(np.float64)
            inverse = stored.reshape(-1, 4, 4).swapaxes(1, 2)  # columns come first
        moves = np.stack([worlds[j] for j in skin["joints"]]) @ inverse[: len(skin["joints"])]
        turns = _turning(moves)
        blended = [np.zeros((0, 4, 4))]
        turned = [np.zeros((0, 3, 3))]
        for block in read:
            moved = np.zeros((len(block["used"]), 4, 4))
            turning = np.zeros((len(block["used"]), 3, 3))
            number = 0
            while f"JOINTS_{number}" in block["at"]:
                joints = self.accessor(block["at"][f"JOINTS_{number}"])[block["used"]]
                weights = self.accessor(block["at"][f"WEIGHTS_{number}"])[block["used"]]
                moved += np.einsum("vk,vkij->vij", weights.astype(np.float64), moves[joints])
                turning += np.einsum("vk,vkij->vij", weights.astype(np.float64), turns[joints])
                number += 1
            blended.append(moved)
            turned.append(turning)
        return np.concatenate(blended), np.concatenate(turned)


def _turning(matrices: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.inv(matrices[..., :3, :3]).swapaxes(-1, -2), np.float64)


def _inbetweens(extras: Any, targets: tuple[str, ...]) -> tuple[tuple[int, int, float], ...]:
    notes = ((extras or {}).get("usdface") or {}).get("inbetweens") or []
    return tuple(
        (targets.index(note["target"]), targets.index(note["shape"]), float(note["weight"]))
        for note in notes
    )


def _local(node: dict[str, Any]) -> FloatArray:
    if "matrix" in node:
        return np.array(node["matrix"], np.float64).reshape(4, 4).T
    local = np.eye(4)
    turn = Rotation.from_quat(node.get("rotation", [0, 0, 0, 1])).as_matrix()
    local[:3, :3] = turn * np.array(node.get("scale", [1, 1, 1]), np.float64)
    local[:3, 3] = node.get("translation", [0, 0, 0])
    return local
