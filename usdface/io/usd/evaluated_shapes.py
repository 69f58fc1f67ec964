"""Blend shapes of one mesh, computed by UsdSkel itself."""

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom, UsdSkel, Vt

from usdface.arrays import FloatArray
from usdface.io.usd.vertex_cache import points_move

__all__ = ["UsdBlendShapes"]

_START = Usd.TimeCode.EarliestTime()


class UsdBlendShapes:
    """UsdSkel's blend shapes of one mesh.

    Attributes
    ----------
    turns_normals : bool
        Whether USD deforms its normals as it does its points.
    """

    def __init__(self, prim: Usd.Prim) -> None:
        self._query = UsdSkel.BlendShapeQuery(UsdSkel.BindingAPI(prim))
        self._indices = self._query.ComputeBlendShapePointIndices()
        self._moves = self._query.ComputeSubShapePointOffsets()
        self._turns = [self._turn(k) for k in range(self._query.GetNumSubShapes())]
        mesh = UsdGeom.Mesh(prim)
        normals, points = mesh.GetNormalsAttr().Get(_START), mesh.GetPointsAttr().Get(_START)
        shown = bool(normals) and len(normals) == len(points)
        shown &= not UsdGeom.PrimvarsAPI(prim).HasPrimvar("normals")
        shown &= mesh.GetNormalsInterpolation() in ("vertex", "varying")
        # Where a shape has no normal offsets USD shows it with the normals it has at rest.
        complete = all(len(t) or not len(m) for t, m in zip(self._turns, self._moves, strict=True))
        # Nor does it turn them with points that change over time, as the written file does.
        self.turns_normals = shown and complete and not points_move(mesh)

    def _turn(self, number: int) -> Vt.Vec3fArray:
        between = self._query.GetInbetween(number)
        if between:
            return between.GetNormalOffsets() or Vt.Vec3fArray()
        shape = self._query.GetBlendShape(self._query.GetBlendShapeIndex(number))
        return (shape.GetNormalOffsetsAttr().Get() if shape else None) or Vt.Vec3fArray()

    def move(self, points: Vt.Vec3fArray, weights: Vt.FloatArray) -> None:
        """Move points (V, 3) in place."""
        self._apply(points, weights, self._moves)

    def turn(self, normals: Vt.Vec3fArray, weights: Vt.FloatArray) -> None:
        """Turn normals (V, 3) in place; they are no unit vectors then."""
        self._apply(normals, weights, self._turns)

    @property
    def count(self) -> int:
        """How many sub-shapes there are: shapes and their inbetweens."""
        return len(self._moves)

    def part(self, number: int, still: NDArray[np.float32], turning: bool = False) -> Vt.Vec3fArray:
        """Return the change of points, or of normals, by one sub-shape at weight 1."""
        values = Vt.Vec3fArray.FromNumpy(still)
        one, place = Vt.FloatArray([1.0]), Vt.UIntArray([number])
        shape = Vt.UIntArray([self._query.GetBlendShapeIndex(number)])
        offsets = self._turns if turning else self._moves
        self._query.ComputeDeformedPoints(one, shape, place, self._indices, offsets, values)
        return values

    def weights(self, weights: FloatArray) -> FloatArray:
        """Return the weights (F, B) of the sub-shapes by those of the shapes (F, S)."""
        result = np.zeros((len(weights), self.count))
        for row, given in zip(result, weights.astype(np.float32), strict=True):
            if len(given):
                values, _, places = self._query.ComputeSubShapeWeights(
                    Vt.FloatArray.FromNumpy(given)
                )
                np.add.at(row, np.array(places, np.int64), np.array(values, np.float64))
        return result

    def _apply(self, values: Vt.Vec3fArray, weights: Vt.FloatArray, offsets: object) -> None:
        if len(weights):
            parts = self._query.ComputeSubShapeWeights(weights)
            self._query.ComputeDeformedPoints(*parts, self._indices, offsets, values)
