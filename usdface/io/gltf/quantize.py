"""Quantisation of points to 16-bit integers, in a box from -1 to 1 (KHR_mesh_quantization).

The transform that puts them back stands in the mesh's node, or for a skinned mesh, whose node does
not count, in inverse bind matrices of its own. Points and offsets share one step, so a
posed point is off by at most the step's half for itself and, times its weight, for each shape.
"""

from dataclasses import dataclass, replace

import numpy as np

from usdface.arrays import FloatArray
from usdface.findings import Finding, finding
from usdface.rigs import BlendShape, Inbetween, Mesh

__all__ = ["Box", "bounding_box"]

_STEPS = 2**15 - 1  # of a normalised 16-bit integer: glTF 2.0, 3.11


@dataclass(frozen=True, eq=False, slots=True)
class Box:
    """A cube: its `centre` (3,) and half its `size`, in metres."""

    centre: FloatArray
    size: float

    @property
    def matrix(self) -> FloatArray:
        """From the box to metres: (4, 4), row vectors."""
        matrix = np.diag([self.size] * 3 + [1.0])
        matrix[3, :3] = self.centre
        return matrix

    @property
    def error(self) -> float:
        """By how much a stored point or offset can be off [m]: half a step along each axis."""
        return float(np.sqrt(3) * self.size / (2 * _STEPS))

    def boxed(self, mesh: Mesh) -> Mesh:
        """Return the mesh in the box's own units."""

        def shape(of: BlendShape) -> BlendShape:
            between = tuple(self._inbetween(b) for b in of.inbetweens)
            return replace(of, offsets=of.offsets / self.size, inbetweens=between)

        points = (mesh.points - self.centre) / self.size
        return replace(mesh, points=points.clip(-1, 1), shapes=tuple(map(shape, mesh.shapes)))

    def _inbetween(self, of: Inbetween) -> Inbetween:
        return replace(of, offsets=of.offsets / self.size)

    def announced(self, name: str) -> Finding:
        """Return the finding that states the bound."""
        micro = self.error * 1e6
        message = (
            "points are rounded by at most {rounding_um:.3g} micrometres at rest, and by "
            "{rounding_um:.3g} more for each shape at weight 1"
        )
        return finding("POINTS_ROUNDED", name, message, micro)


def bounding_box(mesh: Mesh) -> Box:
    """Return the smallest cube that holds a mesh's points, and the moves of its shapes as sizes."""
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    moves = [o for s in mesh.shapes for o in (s.offsets, *(b.offsets for b in s.inbetweens))]
    largest = max((float(np.abs(o).max(initial=0.0)) for o in moves), default=0.0)
    size = max(float((high - low).max()) / 2, largest)
    # A hair more, so that rounding to 32 bits does not leave the box.
    return Box((low + high) / 2, size * (1 + 1e-6) if size > 0 else 1.0)
