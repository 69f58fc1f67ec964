"""A skeleton of a body with a head, turned at every joint."""

import numpy as np
from scipy.spatial.transform import Rotation

from usdface.rigs import Skeleton

__all__ = ["REST", "place", "skeleton", "worlds"]

JOINTS = (
    "hips",
    "hips/neck",
    "hips/neck/head",
    "hips/neck/head/jaw",
    "hips/neck/head/eye",
    "hips/arm",
)
NAMES = ("Hips", "Neck", "Head", "Jaw", "Eye", "Arm")


def place(rotation: list[float], translation: list[float]) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_rotvec(rotation).as_matrix().T
    matrix[3, :3] = translation
    return matrix


REST = np.array([place([0.1 * k, 0.2, -0.3], [0.1, 0.4, 0.02 * k]) for k in range(6)])
PARENTS = [-1, 0, 1, 2, 2, 0]


def worlds(local: np.ndarray) -> np.ndarray:
    result: list[np.ndarray] = []
    for k, parent in enumerate(PARENTS):
        result.append(local[k] if parent < 0 else local[k] @ result[parent])
    return np.array(result)


def skeleton(bind: np.ndarray | None = None) -> Skeleton:
    return Skeleton(JOINTS, NAMES, worlds(REST) if bind is None else bind, REST)
