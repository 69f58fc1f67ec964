"""A mesh of nine random points with three blend shapes, or as a test changes it."""

import numpy as np

from usdface.rigs import BlendShape, Mesh

RNG = np.random.default_rng(11)
POINTS = RNG.normal(size=(9, 3))
DENSE = np.where(RNG.random((3, 9, 1)) < 0.5, RNG.normal(size=(3, 9, 3)), 0.0)
NAMES = ("jawOpen", "smile L", "口")


def shape(indices: list[int], name: str = "a", **fields: object) -> BlendShape:
    return BlendShape(name, indices, np.ones((len(indices), 3)), **fields)  # type: ignore[arg-type]


def face(**changes: object) -> Mesh:
    shapes = tuple(BlendShape.from_dense(n, d) for n, d in zip(NAMES, DENSE, strict=True))
    given = {"points": POINTS, "face_counts": [3, 4], "face_indices": [0, 1, 2, 3, 4, 5, 6]}
    return Mesh(**({"name": "face"} | given | {"shapes": shapes} | changes))  # type: ignore[arg-type]
