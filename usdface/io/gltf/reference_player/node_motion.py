"""Nodes and skins of a glTF in one animation.

Source: glTF 2.0 specification, sections 3.5 (node transforms), 3.7.3 (skins), 3.11 (animations).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.certificate.vertex_transforms import VertexTransforms
from usdface.io.gltf.reference_player.deformed_mesh import Sampled

if TYPE_CHECKING:
    from scipy.sparse import csr_array

__all__ = ["PlayerNodes", "Space"]


@dataclass(frozen=True, eq=False, slots=True)
class Space:
    """Transforms of the points and the normals of a mesh by its nodes.

    Attributes
    ----------
    at : function from times (F,) to two arrays
        Transforms of points to the scene, (4, 4), (N, 4, 4), (F, 1, 4, 4) or (F, N, 4, 4), for
        column vectors; and the same for normals, (3, 3), ...; a skin blends the
        normals of its joints.
    motion : function from times (F,) and N to VertexTransforms or None
        The same by joints, where they move.
    stretch : function from times (F,) to (F or 1, 2)
        The most by which they stretch points, and normals.
    """

    at: Callable[[FloatArray], tuple[FloatArray, FloatArray]]
    motion: Callable[[FloatArray, int], VertexTransforms | None] = lambda times, count: None
    stretch: Callable[[FloatArray], FloatArray] = lambda times: np.ones((1, 2))


@dataclass(frozen=True, eq=False, slots=True)
class PlayerNodes:
    """The nodes of a scene in one animation.

    Attributes
    ----------
    nodes : sequence of dict
        As in the JSON.
    parents : mapping of int to int
        Parent of each node of the scene, -1 for a root.
    curves : mapping of (int, str) to Sampled
        Animated translations, rotations and scales of nodes.
    """

    nodes: Sequence[dict[str, Any]]
    parents: Mapping[int, int]
    curves: Mapping[tuple[int, str], Sampled]
    _known: dict[tuple[tuple[int, ...], bytes], FloatArray] = field(default_factory=dict)

    def moves(self, node: int) -> bool:
        """Whether a node moves, by itself or with one above it."""
        moving = {n for n, _ in self.curves}
        while node >= 0 and node not in moving:
            node = self.parents[node]
        return node >= 0

    def worlds(self, wanted: Sequence[int], times: FloatArray) -> FloatArray:
        """Return the transforms of nodes to the scene: (J, F or 1, 4, 4), for column vectors."""
        key = tuple(wanted), times.tobytes()
        if key not in self._known:
            if len(self._known) > 3:  # meshes that share a skin ask for the same, one by one
                self._known.clear()
            self._known[key] = self._worlds(wanted, times)
        return self._known[key]

    def _worlds(self, wanted: Sequence[int], times: FloatArray) -> FloatArray:
        known: dict[int, FloatArray] = {-1: np.eye(4)[None]}

        def world(node: int) -> FloatArray:
            if node not in known:
                known[node] = world(self.parents[node]) @ self._local(node, times)
            return known[node]

        result = [world(node) for node in wanted]
        frames = max((len(r) for r in result), default=1)
        return np.stack([np.broadcast_to(r, (frames, 4, 4)) for r in result])

    def _local(self, index: int, times: FloatArray) -> FloatArray:
        node = self.nodes[index]
        if "matrix" in node:
            return np.array(node["matrix"], np.float64).reshape(1, 4, 4).swapaxes(1, 2)

        def part(path: str, rest: list[float]) -> FloatArray:
            curve = self.curves.get((index, path))
            return np.array([node.get(path, rest)], float) if curve is None else curve.at(times)

        linear = _rotations(part("rotation", [0, 0, 0, 1])) * part("scale", [1, 1, 1])[:, None, :]
        move = part("translation", [0, 0, 0])
        local = np.tile(np.eye(4), (max(len(linear), len(move)), 1, 1))
        local[:, :3, :3], local[:, :3, 3] = linear, move
        return local

    def of_node(self, node: int) -> Space:
        """Return the transforms of points and normals of a mesh without a skin to the scene."""

        def space(times: FloatArray) -> tuple[FloatArray, FloatArray]:
            world = self.worlds([node], times)[0]
            return (world[:, None], _normal_matrix(world)[:, None]) if moving else (still, turned)

        def motion(times: FloatArray, count: int) -> VertexTransforms:
            world = self.worlds([node], times)[0]
            return VertexTransforms.rigid(world[:, :3], _normal_matrix(world), count)

        moving = self.moves(node)
        still = self.worlds([node], np.zeros(1))[0, 0]
        turned = _normal_matrix(still)

        def stretch(times: FloatArray) -> FloatArray:
            return _stretch(self.worlds([node], times))

        return Space(space, motion, stretch)

    def of_skin(self, joints: Sequence[int], inverse: FloatArray, weights: "csr_array") -> Space:
        """Return the transforms of points and normals of a skinned mesh to the scene.

        `inverse` (J, 4, 4) are the inverse bind matrices, `weights` (N, J) the influences.
        """

        def blended(times: FloatArray) -> tuple[FloatArray, FloatArray]:
            moves = self.worlds(joints, times) @ inverse[:, None]
            return _blend(weights, moves), _blend(weights, _normal_matrix(moves))

        def motion(times: FloatArray, count: int) -> VertexTransforms | None:
            moves = (self.worlds(joints, times) @ inverse[:, None]).swapaxes(0, 1)
            return VertexTransforms.of(
                moves[..., :3, :], _normal_matrix(moves), *_side_by_side(weights)
            )

        def stretch(times: FloatArray) -> FloatArray:
            return _stretch(self.worlds(joints, times) @ inverse[:, None])

        if any(self.moves(joint) for joint in joints):
            return Space(blended, motion, stretch)
        points, normals = (part[0] for part in blended(np.zeros(1)))
        return Space(lambda times: (points, normals), stretch=stretch)


def _stretch(matrices: FloatArray) -> FloatArray:
    """Return the most by which any of matrices (J, F, 4, 4) stretches points and normals: (F, 2).

    A mixture of them stretches no more: the largest singular value is a norm.
    """
    both = matrices[..., :3, :3], _normal_matrix(matrices)
    return np.stack([np.linalg.norm(m, 2, axis=(-2, -1)).max(axis=0) for m in both], -1)


def _side_by_side(weights: "csr_array") -> tuple[IntArray, FloatArray]:
    """Return the joints (N, K) and weights (N, K) of each vertex; those that lack some weigh 0."""
    counts = np.diff(weights.indptr)
    row = np.repeat(np.arange(len(counts)), counts)
    place = np.arange(len(row)) - np.repeat(weights.indptr[:-1], counts)
    joints = np.zeros((len(counts), counts.max(initial=0)), np.int64)
    values = np.zeros(joints.shape)
    joints[row, place], values[row, place] = weights.indices, weights.data
    return joints, values


def _blend(weights: "csr_array", matrices: FloatArray) -> FloatArray:
    """Return the matrices (J, F, K, K) mixed by `weights` (N, J): (F, N, K, K)."""
    joints, frames, size, _ = matrices.shape
    mixed = np.asarray(weights @ matrices.reshape(joints, -1))
    return mixed.reshape(-1, frames, size, size).swapaxes(0, 1)


def _normal_matrix(matrices: FloatArray) -> FloatArray:
    linear = matrices[..., :3, :3]
    flat = np.abs(np.linalg.det(linear)) < 1e-30  # scaled to 0: there is no visible normal
    safe = np.where(flat[..., None, None], np.eye(3), linear)
    return np.asarray(np.linalg.inv(safe).swapaxes(-1, -2), np.float64)


def _rotations(quaternions: FloatArray) -> FloatArray:
    """Return quaternions x, y, z, w (F, 4) as matrices (F, 3, 3)."""
    length = np.linalg.norm(quaternions, axis=1, keepdims=True)
    if not length.all():
        raise ValueError("a rotation is the zero quaternion")
    x, y, z, w = (quaternions / length).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)
