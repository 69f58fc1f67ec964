"""Motion of the character's head, as solved or as recorded."""

import numpy as np

from usdface.arrays import BoolArray
from usdface.face.bound_face import BoundFace
from usdface.findings import Finding
from usdface.geometry.rigid_fit import Pose
from usdface.retarget.first_pose import shows_pose
from usdface.retarget.head_motion import head_motion
from usdface.retarget.recorded_head import recorded_head
from usdface.retarget.solution import Solution
from usdface.shot.shot import Shot
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["character_head"]


def character_head(
    shot: Shot, face: BoundFace, solution: Solution | None
) -> tuple[Pose | None, list[Finding]]:
    """Return the motion of a character's head, None where it stays, and findings."""
    setup = shot.setup
    if not setup.move_head or setup.head == "stabilised":
        return None, []
    if isinstance(shot.take, WeightsTake):
        return recorded_head(shot.take, shot.rig, face.mesh, setup)
    if solution is None or not solution.posed_in_space:
        return None, []
    target = face.mesh.points[face.vertices_of(solution.markers)]
    motion = head_motion(
        solution.pose,
        solution.weights.times,
        target if solution.filmed else solution.neutral,
        target,
        solution.noise,
        _head_seen(shot, solution),
    )
    return motion, []


def _head_seen(shot: Shot, solution: Solution) -> BoolArray:
    """Return which markers determine the head's pose: (F, M) bool."""
    seen = ~np.isnan(solution.distances)
    if solution.head == "markers" and isinstance(shot.take, MarkerTake):
        posed = shows_pose(shot.take, seen, solution.head, shot.setup.head_markers)
        seen = np.broadcast_to(posed[:, None], seen.shape)
    return seen
