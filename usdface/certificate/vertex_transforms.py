"""Motion of vertices by joints, or by one transform, over many frames."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from usdface.arrays import FloatArray, IntArray

__all__ = ["VertexTransforms", "placed"]

_MOST = 2**24  # weights: 128 MB


@dataclass(frozen=True, eq=False, slots=True)
class VertexTransforms:
    """Transforms of N vertices at F moments: weighted sums of those of J joints.

    Attributes
    ----------
    transforms : (F, J, 3, 4) float64 [m]
        Of points, to the scene, for column vectors.
    turns : (F, J, 3, 3) float64
        Of normals; unit vectors follow after the sum.
    weights : (G, J) float64
        A row for each group of vertices that have the same.
    groups : (N,) int64
        The group of each vertex.
    """

    transforms: FloatArray
    turns: FloatArray
    weights: FloatArray
    groups: IntArray

    @classmethod
    def of(
        cls, transforms: FloatArray, turns: FloatArray, joints: IntArray, weights: FloatArray
    ) -> "VertexTransforms | None":
        """Make a motion by the joints (N, K) that hold each vertex and their weights (N, K).

        None where vertices with weights of their own are too many to hold.
        """
        held = np.concatenate([joints.astype(np.float64), weights], 1)
        rows, groups = np.unique(held, axis=0, return_inverse=True)
        count = transforms.shape[1]
        if len(rows) * count > _MOST:
            return None
        apart = np.zeros((len(rows), count))
        own, by = np.split(rows, 2, axis=1)
        np.add.at(apart, (np.arange(len(rows))[:, None], own.astype(np.int64)), by)
        return cls(transforms, turns, apart, groups.ravel().astype(np.int64))

    @classmethod
    def rigid(cls, transforms: FloatArray, turns: FloatArray, count: int) -> "VertexTransforms":
        """Make the motion of `count` vertices by transforms (F, 3, 4) and (F, 3, 3) alone."""
        nowhere = np.zeros(count, np.int64)
        return cls(transforms[:, None], turns[:, None], np.ones((1, 1)), nowhere)

    def of_points(self, frames: IntArray, groups: IntArray) -> FloatArray:
        """Return the transforms (f, g, 3, 4) of groups (g,) at frames (f,)."""
        return _mixed(self.weights[groups], self.transforms[frames])

    def of_normals(self, frames: IntArray, groups: IntArray) -> FloatArray:
        """Return the transforms (f, g, 3, 3) of normals of groups (g,) at frames (f,)."""
        return _mixed(self.weights[groups], self.turns[frames])


def _mixed(weights: FloatArray, matrices: FloatArray) -> FloatArray:
    frames, joints, rows, columns = matrices.shape
    return np.asarray(weights @ matrices.reshape(frames, joints, -1)).reshape(
        frames, -1, rows, columns
    )


def placed(matrices: NDArray[Any], vectors: NDArray[Any]) -> NDArray[Any]:
    """Apply matrices (f, n, 3, 3), or (f, 1, 3, 3) for all, to vectors (f, n, 3)."""
    if matrices.shape[1] == 1:
        return np.asarray(vectors @ matrices[:, 0].swapaxes(1, 2))
    return np.asarray(np.einsum("fnij,fnj->fni", matrices, vectors))
