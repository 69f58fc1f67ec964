"""Shrinkage of the brows by the solve, and the factor that undoes it.

Where performer and rig differ, the ridge of the solve makes motion smaller that the blend shapes
explain badly: brows that go sideways as they rise, on a rig whose brows only rise, come out at half
their size. The mixture of blend shapes stands; its size is that of a least-squares fit without a
ridge, as in a relaxed fit (N. Meinshausen, "Relaxed Lasso", Computational Statistics & Data
Analysis 52, 2007).

Of the brows alone: no other region moves their markers. In the mouth blend shapes explain each
other, and weights that are too many are not too small (`python -m benchmarks.shrinkage`).
"""

import numpy as np

from usdface.arrays import BoolArray
from usdface.blend_shape_evaluator import BlendShapeEvaluator
from usdface.face.lip_lid_contacts import LipLidContacts
from usdface.face.regions import shape_regions
from usdface.frame_blocks import frame_blocks
from usdface.geometry.rigid_modes import motion_basis
from usdface.retarget.solution import Solution
from usdface.rigs import Mesh

__all__ = ["brow_factor"]

# RMS displacement of a marker by the brows [m] at which the factor counts by a half: less is noise.
_COUNTS = 0.0005
# Markers that move twice as far as the rig solved say that it has no blend shapes for this motion.
_MOST = 2.0


def brow_factor(solution: Solution, mesh: Mesh, *, moving_head: bool) -> float:
    """Return the factor at which the solved brows come nearest to the markers: 1 to 2.

    Parameters
    ----------
    solution : Solution
        Of markers in space; 1 of an image, which does not see how far brows come forward.
    mesh : Mesh
        Whose blend shapes the solution's weights are of.
    moving_head : bool
        The head's pose was solved with the weights: its small motions say nothing.
    """
    names = solution.weights.names
    nothing = np.zeros((0, 2), dtype=np.int64)
    brows = np.isin(names, shape_regions(mesh, LipLidContacts(nothing, nothing))["brows"])
    if solution.model is None or not solution.in_space or not brows.any():
        return 1.0
    rest = solution.rest
    rigid = motion_basis(rest, 3) if moving_head else np.zeros((rest.size, 0))
    squares, both, frames = np.zeros((2, 2)), np.zeros(2), len(solution.distances)
    for block in frame_blocks(frames):
        weights = solution.weights.weights[block]
        parts = [solution.model.displacements(weights * own) for own in (brows, ~brows)]
        seen = np.repeat(~np.isnan(solution.distances[block]), 3, axis=1)
        left = np.where(seen, solution.leftover(block).reshape(seen.shape), 0.0)
        parts = [np.where(seen, part - (part @ rigid) @ rigid.T, 0.0) for part in parts]
        squares += [[np.vdot(one, other) for other in parts] for one in parts]
        both += [np.vdot(part, left) for part in parts]
    # The rest of the face has a factor of its own, or its shrinkage would look like that of brows
    # that move at the same time; it is not used.
    squares[0, 0] += frames * _markers_moved(solution.model, brows) * _COUNTS**2
    squares += 1e-12 * max(np.trace(squares), 1e-300) * np.eye(2)
    return float(np.clip(1.0 + np.linalg.solve(squares, both)[0], 1.0, _MOST))


def _markers_moved(model: BlendShapeEvaluator, brows: BoolArray) -> float:
    """Return how many markers the brows move, the less the less: a participation ratio."""
    squares = (model.offsets[brows] ** 2).sum(axis=0).reshape(-1, 3).sum(axis=1)
    return float(squares.sum() ** 2 / max((squares**2).sum(), 1e-300))
