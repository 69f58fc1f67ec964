"""By how much lines may miss a cubic curve: so little that the certificate does not warn."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from usdface.arrays import FloatArray
from usdface.io.gltf.nodes import NodeTree

__all__ = ["CurveTolerance", "curve_tolerance"]

# The certificate allows 1e-5 of a weight, and of the bounding diagonal for vertices.
_WEIGHT = 8e-6  # leaves a fifth for the rounding of values and times to float32
_OF_DIAGONAL = 2e-6  # of one path of one node: a few above one another add up
_SMALLEST = 1e-3  # [m] of a diagonal, as in the certificate


@dataclass(frozen=True, eq=False, slots=True)
class CurveTolerance:
    """Tolerances for the curves of a scene.

    Attributes
    ----------
    weights : float
    turns : float
        Of a quaternion's component, and of a scale.
    moves : (N,) float64
        Of the translation of each node, in the units of its parent.
    """

    weights: float
    turns: float
    moves: FloatArray = field(repr=False)

    def of(self, path: str, node: int) -> float:
        """Return the tolerance of a node's "translation", "rotation" or "scale"."""
        return float(self.moves[node]) if path == "translation" else self.turns


def curve_tolerance(
    points: Sequence[FloatArray], tree: NodeTree, moved: Sequence[int]
) -> CurveTolerance:
    """Return tolerances by the size of the meshes and their distance from the nodes.

    Parameters
    ----------
    points : sequence of (V, 3) float64 [m]
        Of all meshes, at rest; without any, lengths count by the nodes that move.
    tree : NodeTree
    moved : sequence of int
        The nodes that may move.
    """
    joints = tree.worlds[list(moved), 3, :3].reshape(-1, 3)
    filled = [p for p in points if len(p)] or [joints]
    low = np.min([p.min(axis=0, initial=np.inf) for p in filled], axis=0)
    high = np.max([p.max(axis=0, initial=-np.inf) for p in filled], axis=0)
    diagonal = float(np.linalg.norm(high - low)) if np.isfinite(high - low).all() else 0.0
    diagonal = max(diagonal, _SMALLEST)
    # From a node to the farthest corner of the box: a turn moves a vertex that far from it most.
    arms = np.linalg.norm(np.maximum(np.abs(joints - low), np.abs(joints - high)), axis=1)
    reach = max(float(arms.max(initial=0.0)), diagonal)
    above = [tree.worlds[p, :3, :3] if p >= 0 else np.eye(3) for p in tree.parents]
    stretch = np.linalg.norm(np.reshape(above, (-1, 3, 3)), ord=2, axis=(1, 2))
    moves = _OF_DIAGONAL * diagonal / np.where(stretch > 0, stretch, 1.0)
    return CurveTolerance(_WEIGHT, _OF_DIAGONAL * diagonal / reach, moves)
