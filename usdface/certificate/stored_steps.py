"""Rounding of a mesh whose points and normals are stored as whole numbers.

A component is off by at most half a step of its accessor, a vector by √3 times that. A posed vector
is a sum: one rounding of its own and, times its weight, one of each shape. Joints and nodes stretch
it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from usdface.arrays import FloatArray, IntArray

__all__ = ["HalfSteps", "StoredSteps", "turned_by"]


@dataclass(frozen=True, eq=False, slots=True)
class HalfSteps:
    """Half a step of each accessor of a mesh with T shapes, in stored units; 0 for floats.

    Attributes
    ----------
    points, normals : float
        Of the mesh at rest.
    moves, turns : (T,) float64
        Of each shape's offsets of points and of normals.
    """

    points: float
    normals: float
    moves: FloatArray
    turns: FloatArray

    @property
    def any(self) -> bool:
        """Whether anything is stored as whole numbers."""
        return bool(self.points or self.normals or self.moves.any() or self.turns.any())


@dataclass(frozen=True, eq=False, slots=True)
class StoredSteps:
    """Half-steps of a mesh, and its F poses.

    Attributes
    ----------
    halves : HalfSteps
    weights : (F, T) float64
        As the file has them: an inbetween is a shape of its own.
    stretch : (F, 2) float64
        The most by which joints and nodes stretch points, to metres, and normals.
    lengths_at : function from frames (f,) to (f, N) float64
        Lengths of the posed normals, stretched.
    """

    halves: HalfSteps
    weights: FloatArray
    stretch: FloatArray
    lengths_at: Callable[[IntArray], FloatArray]

    def of_points(self, frames: IntArray) -> FloatArray:
        """Return by how much a point is off at most at frames (f,): (f,) [m]."""
        halves = self.halves.points + np.abs(self.weights[frames]) @ self.halves.moves
        return np.asarray(np.sqrt(3) * halves * self.stretch[frames, 0])

    def of_normals(self, frames: IntArray) -> FloatArray:
        """Return by how much a posed normal is off at most, before it gets unit length: (f,)."""
        halves = self.halves.normals + np.abs(self.weights[frames]) @ self.halves.turns
        return np.asarray(np.sqrt(3) * halves * self.stretch[frames, 1])

    def of_angles(self, frames: IntArray) -> FloatArray:
        """Return by how much a normal is turned at most at frames (f,): (f, N) [degrees]."""
        return turned_by(self.of_normals(frames)[:, None], self.lengths_at(frames))

    def of_mixture(self, shares: FloatArray, frames: IntArray) -> float:
        """Return by how much a sum of frames (f,) with shares (f,) is off [m].

        As if shapes alone moved the mesh.
        """
        mixed = np.abs(shares @ self.weights[frames]) @ self.halves.moves
        halves = self.halves.points * abs(float(shares.sum())) + float(mixed)
        return float(np.sqrt(3) * halves * self.stretch[frames, 0].max())


def turned_by(error: FloatArray, lengths: NDArray[Any]) -> FloatArray:
    """Return by how much an error turns vectors at most [degrees]; 180 where it can cancel one."""
    ratio = error / np.maximum(lengths, 1e-30)
    return np.asarray(np.where(ratio < 1, np.degrees(np.arcsin(ratio.clip(max=1.0))), 180.0))
