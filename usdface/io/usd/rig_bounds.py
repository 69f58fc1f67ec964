"""The space that a character fills while its blend shapes move."""

import itertools

import numpy as np

from usdface.rigs import BlendShape, Mesh, Skeleton, Skin
from usdface.takes import FloatArray, WeightsTake

__all__ = ["posed_bounds"]


def posed_bounds(mesh: Mesh, skeleton: Skeleton | None, curves: WeightsTake | None) -> FloatArray:
    """Return a box (2, 3) around the mesh at rest for all weights in [0, 1] and in `curves`."""
    if not len(mesh.points):
        return np.zeros((2, 3))
    box = np.array([mesh.points, mesh.points])
    for shape in mesh.shapes:
        low, high = 0.0, 1.0
        if curves is not None:
            column = curves.column(shape.name)
            low, high = min(low, column.min()), max(high, column.max())
        reached = _reached(shape, float(low), float(high))
        box[0, shape.indices] += reached.min(axis=0)
        box[1, shape.indices] += reached.max(axis=0)
    if skeleton is None or mesh.skin is None:
        return np.array([box[0].min(axis=0), box[1].max(axis=0)])
    moves = _skinning_at_rest(skeleton)
    corners = [
        _skinned(
            np.stack([box[side, :, axis] for axis, side in enumerate(sides)], 1), mesh.skin, moves
        )
        for sides in itertools.product((0, 1), repeat=3)
    ]
    return np.array([np.min(corners, axis=(0, 1)), np.max(corners, axis=(0, 1))])


def _reached(shape: BlendShape, low: float, high: float) -> FloatArray:
    """Return the corners (K, N, 3) of a shape's path over the weights from `low` to `high`.

    The path is straight between inbetweens and goes on straight beyond them, as UsdSkel's.
    """
    knots = {0.0: np.zeros_like(shape.offsets), 1.0: shape.offsets}
    for between in shape.inbetweens:
        knots.setdefault(between.weight, between.offsets)
    weights = np.array(sorted(knots))
    values = np.array([knots[weight] for weight in sorted(knots)])
    corners = list(values[(weights > low) & (weights < high)])
    for weight in (low, high):
        right = int(np.searchsorted(weights, weight).clip(1, len(weights) - 1))
        part = (weight - weights[right - 1]) / (weights[right] - weights[right - 1])
        corners.append(values[right - 1] + part * (values[right] - values[right - 1]))
    return np.array(corners)


def _skinning_at_rest(skeleton: Skeleton) -> FloatArray:
    world = skeleton.rest.copy()
    places = {joint: i for i, joint in enumerate(skeleton.joints)}
    for i, joint in enumerate(skeleton.joints):
        parent = places.get(joint.rpartition("/")[0], -1)
        if parent >= 0:
            world[i] = skeleton.rest[i] @ world[parent]
    return np.linalg.pinv(skeleton.bind) @ world


def _skinned(points: FloatArray, skin: Skin, moves: FloatArray) -> FloatArray:
    full = np.concatenate([points, np.ones((len(points), 1))], axis=1)
    result = np.zeros((len(points), 3))
    for joints, weights in zip(skin.joints.T, skin.weights.T, strict=True):
        result += weights[:, None] * np.einsum("vi,vij->vj", full, moves[joints])[:, :3]
    return result
