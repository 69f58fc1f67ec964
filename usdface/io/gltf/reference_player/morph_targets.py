"""Morph targets of a mesh, stored sparsely: most vertices of a face do not move."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from usdface.arrays import FloatArray
from usdface.certificate.vertex_offsets import VertexOffsets, moved_part

__all__ = ["PlayerTargets", "Target"]


@dataclass(frozen=True, eq=False, slots=True)
class Target:
    """One target: `values` (n, 3) float32 at the vertices `places` (n,), which increase."""

    places: NDArray[np.int32]
    values: NDArray[np.float32]

    @classmethod
    def of(cls, values: NDArray[np.float32]) -> "Target":
        """Make a target of the rows of values (N, 3) that are not zero."""
        places, moved = moved_part(values)
        return cls(places.astype(np.int32), moved)


@dataclass(frozen=True, eq=False, slots=True)
class PlayerTargets:
    """All targets of a mesh.

    Attributes
    ----------
    count : int
        N, vertices of the mesh.
    targets : tuple of Target
    """

    count: int
    targets: tuple[Target, ...]

    @classmethod
    def of(cls, values: NDArray[np.float32]) -> "PlayerTargets":
        """Make targets of the rows of values (T, N, 3) that are not zero."""
        return cls(values.shape[1], tuple(map(Target.of, values)))

    @classmethod
    def side_by_side(cls, meshes: Sequence["PlayerTargets"], count: int) -> "PlayerTargets":
        """Join meshes of which each has up to `count` targets to one."""
        if len(meshes) == 1:
            return meshes[0]
        places: list[list[NDArray[np.int32]]] = [[] for _ in range(count)]
        values: list[list[NDArray[np.float32]]] = [[] for _ in range(count)]
        start = 0
        for mesh in meshes:
            for k, target in enumerate(mesh.targets):
                places[k].append(target.places + np.int32(start))
                values[k].append(target.values)
            start += mesh.count
        joined = (
            Target(np.concatenate(p), np.concatenate(v))
            for p, v in zip(places, values, strict=True)
        )
        return cls(start, tuple(joined))

    def offsets(self, matrices: FloatArray | None = None) -> VertexOffsets:
        """Return the values, by a matrix (3, 3), or by those (N, 3, 3) of each vertex."""

        def placed(target: Target) -> NDArray[np.float32]:
            if matrices is None:
                return target.values
            if matrices.ndim == 2:
                return np.asarray(target.values @ matrices.T, np.float32)
            own = matrices[target.places]
            return np.asarray(np.einsum("nij,nj->ni", own, target.values), np.float32)

        return VertexOffsets.of(self.count, ((t.places, placed(t)) for t in self.targets))

    def added(self, weights: FloatArray) -> FloatArray:
        """Return the weighted sum of the targets for `weights` (F, T): (F, N, 3).

        In time proportional to the vertices that they move.
        """
        result = np.zeros((len(weights), self.count, 3))
        for k in np.flatnonzero(weights.any(axis=0)).tolist():
            target = self.targets[k]
            result[:, target.places] += weights[:, k, None, None] * target.values
        return result
