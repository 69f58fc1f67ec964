"""Meshes near a face that do not follow its head: teeth or lashes that nothing binds to it."""

import numpy as np
from pxr import Sdf

from usdface.arrays import BoolArray, FloatArray
from usdface.findings import Finding, finding
from usdface.geometry.rigid_fit import Pose
from usdface.io.usd.character_meshes import character_meshes, points_of
from usdface.io.usd.head_motion import HeadCarrier, JointCarrier
from usdface.io.usd.shot import StagedShot
from usdface.rigs import Mesh
from usdface.shot.shot import ShotResult

__all__ = ["report_detached"]

# Set by hand. The share of the face's size that its box is larger: eyes may be behind a mask.
_MARGIN = 0.1
# Shares of a mesh's points in the box, and of a vertex's skin weight on the carrier.
_INSIDE = _CARRIED = 0.5
_SEEN = 0.001  # m


def report_detached(staged: StagedShot, result: ShotResult) -> list[Finding]:
    """Return MESHES_LEFT_BEHIND for the meshes near the face that do not move with the head."""
    motion, carrier = result.head_motion, staged.prims.head
    if motion is None or carrier is None:
        return []
    rig = staged.shot.rig
    face = rig.mesh(staged.shot.setup.binding.mesh)
    carried = {mesh.path: _carried(mesh, carrier, staged.prims.skel_root) for mesh in rig.meshes}
    box = _box(face.points[carried[face.path]])
    beside = [p for p in character_meshes(staged) if str(p.GetPath()) not in carried]
    places = {mesh.path: mesh.points for mesh in rig.meshes} | points_of(beside, staged)
    behind: dict[str, float] = {}
    for path, points in places.items():
        moves = carried.get(path, np.zeros(len(points), bool))
        if moves.mean() < _CARRIED and _is_inside(points, box):
            distance = _largest_shift(points.mean(axis=0), motion)
            behind |= {path: distance} if distance > _SEEN else {}
    if not behind:
        return []
    message = (
        "{meshes} do not follow the head, by up to {distance_mm:.0f} mm: only what is bound to "
        "{joint} moves with it"
    )
    furthest = max(behind.values()) * 1000
    values = ([*behind], furthest, carrier.name)
    return [finding("MESHES_LEFT_BEHIND", face.path, message, *values)]


def _carried(mesh: Mesh, carrier: HeadCarrier, skel_root: str) -> BoolArray:
    """Return which points of a mesh of the rig the head's carrier moves: (V,) bool."""
    if not isinstance(carrier, JointCarrier):
        return np.full(len(mesh.points), Sdf.Path(mesh.path).HasPrefix(skel_root))
    if mesh.skin is None:
        return np.zeros(len(mesh.points), bool)
    joints = carrier.skeleton.joints
    top = joints[carrier.joint]
    below = np.array([joint == top or joint.startswith(f"{top}/") for joint in joints])
    share = (mesh.skin.weights * below[mesh.skin.joints]).sum(axis=1)
    return np.asarray(share > _CARRIED * mesh.skin.weights.sum(axis=1))


def _box(points: FloatArray) -> FloatArray:
    """Return the corners (2, 3) of the box of a face and of meshes that lie close to it."""
    low, high = points.min(axis=0), points.max(axis=0)
    margin = np.full(3, _MARGIN * float((high - low).max()))
    above = margin * (1, 0, 1)  # not below: there are collars, which stay
    return np.stack([low - above, high + margin])


def _is_inside(points: FloatArray, box: FloatArray) -> bool:
    inside = ((points >= box[0]) & (points <= box[1])).all(axis=1)
    return bool(inside.mean() >= _INSIDE)


def _largest_shift(point: FloatArray, motion: Pose) -> float:
    """Return how far (m) a pose takes a point (3,) at most."""
    moved = motion.rotations @ point + motion.translations
    return float(np.linalg.norm(moved - point, axis=1).max())
