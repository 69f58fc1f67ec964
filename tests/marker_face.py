"""A face that has no skin but its markers: known neutral places, known displacements."""

from collections.abc import Sequence

import numpy as np

from usdface.arrays import FloatArray
from usdface.face.bound_face import BoundFace
from usdface.rigs import BlendShape, Mesh

__all__ = ["marker_face"]


def marker_face(
    names: Sequence[str] = (),
    neutral: FloatArray | None = None,
    basis: FloatArray | None = None,
    shapes: Sequence[str] = (),
    nose: str = "",
) -> BoundFace:
    """Make it of markers at `neutral` (M, 3) that shapes move by `basis` (S, M, 3) [m]."""
    points = np.zeros((0, 3)) if neutral is None else neutral
    none = np.zeros(0, np.int64)
    blends = tuple(
        BlendShape.from_dense(name, offsets)
        for name, offsets in zip(shapes, [] if basis is None else basis, strict=True)
    )
    mesh = Mesh("Face", points, none, none, shapes=blends)
    return BoundFace(mesh, tuple(names), np.arange(len(points)), nose, rig_shapes=tuple(shapes))
