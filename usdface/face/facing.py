"""The side that a character's face looks to, and the turn that lets it look to the front.

Features, lids and regions are those of a face that looks along +z, as glTF's models do; one that
is turned in a shot, or modelled along another axis, is solved as if it did.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from usdface.arrays import FloatArray, IntArray
from usdface.face.face_points import face_points
from usdface.geometry.bake_transform import bake_transform
from usdface.geometry.marker_spread import rms_radius
from usdface.geometry.signed_volume import signed_volume
from usdface.geometry.vertex_normals import NormalsNear
from usdface.rigs import Mesh, Rig

__all__ = [
    "SLIGHT",
    "UNEVEN",
    "Facing",
    "facing",
    "has_equal_halves",
    "rig_to_front",
    "turn_about_up",
    "turn_to_front",
    "yaw_of",
]

# Markers cover a face unevenly, one half of it in the extreme: their normals are off by so much at
# most [degrees].
UNEVEN = 45.0
# A stage that turns a character by less [degrees] means it; a model that is off by so little is not
# told from one whose markers are uneven.
SLIGHT = 15.0
# A face looks along x or -z, as modelled, if it is within this of it [degrees]. VRM 0.x looks along
# -z.
_ALONG = 30.0
# Share of the box around a mesh that its volume is below 0 if its faces are inside out: that of ICT
# is 0.18, of MakeHuman's body 0.08, of the example 0.35; of a flat mask it says nothing.
_INSIDE_OUT = 0.01
# A rotation with a smaller share about the up axis has none.
_TURNED = 1e-6
# Shorter mean normals have no direction to the side: the face looks up, or markers are all around.
_LEVEL = 0.3
# The same for blend shapes, which also move teeth, tongue and the insides of lips, but both halves
# alike: ICT 0.25, the example 0.30, MakeHuman 0.61.
_LEVEL_OF_SHAPES = 0.12
# A face that looks up or down so many times as far as aside lies, by 63 degrees. Markers of the
# chin alone have 0.8, others less (ICT, MakeHuman, the example).
_LYING = 2.0
# A face has equal halves if half of its points are so near to a mirrored one, in spreads: the
# example, MakeHuman and ICT 0.003 and less, by 20 degrees aside 0.065 and more.
_EQUAL = 0.02
_MIRRORED = 2000  # points that tell
_NO_MARKERS: IntArray = np.zeros(0, dtype=np.int64)


class Facing(NamedTuple):
    """The direction that a face looks in, as far as it is known.

    Attributes
    ----------
    yaw : float or None [degrees]
        About y: 0 is +z, 90 is +x. None where it is not known.
    pitch : float or None [degrees]
        How far up a face looks that lies, below 0 where down; None where it is upright, or that is
        not known.
    """

    yaw: float | None
    pitch: float | None


def facing(mesh: Mesh, bound: IntArray) -> Facing:
    """Return where a face looks: the mean normal of its points.

    Those at vertices `bound` (B,), without any those that the blend shapes move; of faces that are
    inside out the other side.
    """
    x, y, z = _mean_normal(mesh, bound)
    aside = float(np.hypot(x, z))
    level = _LEVEL if len(bound) else _LEVEL_OF_SHAPES
    yaw = float(np.degrees(np.arctan2(x, z))) if aside > level else None
    lies = abs(y) > max(_LYING * aside, level)
    return Facing(yaw, float(np.degrees(np.arctan2(y, aside))) if lies else None)


def has_equal_halves(mesh: Mesh, yaw: float) -> bool:
    """Return whether the two halves of a face that looks to `yaw` [degrees] mirror each other.

    Then that is exact; of a face with blend shapes of one half it is off by up to 27 degrees.
    """
    points = mesh.points[face_points(mesh, _NO_MARKERS).vertices]
    if not len(points):
        return False
    ahead = (points - np.median(points, axis=0)) @ turn_about_up(-yaw)[:3, :3]
    ahead -= np.median(ahead, axis=0)
    some = ahead[:: 1 + len(ahead) // _MIRRORED] * [-1.0, 1.0, 1.0]
    away = np.median(cKDTree(ahead).query(some)[0])
    return bool(away <= _EQUAL * rms_radius(ahead))


def _mean_normal(mesh: Mesh, bound: IntArray) -> FloatArray:
    """Return the mean normal (3,) of the face's points; 0 where there are none."""
    face = face_points(mesh, bound)
    if not len(face.vertices) or not len(mesh.face_counts):
        return np.zeros(3)
    near = NormalsNear(mesh.face_counts, mesh.face_indices, len(mesh.points))
    normals = near.at(mesh.points, face.vertices)
    box = float(np.ptp(mesh.points, axis=0).prod())
    if signed_volume(mesh.points, mesh.face_counts, mesh.face_indices) < -_INSIDE_OUT * box:
        normals = -normals
    return np.asarray(np.average(normals, axis=0, weights=face.shares))


def rig_to_front(rig: Rig) -> Rig:
    """Return a rig, turned for its face to look along +z: its meshes, their shapes and normals.

    For a rig that nothing has placed; `usdface.io.usd.front_facing_rig` knows the turn of a stage.
    The joints stay.
    """
    looks = facing(rig.face(), _NO_MARKERS).yaw
    equal = looks is not None and has_equal_halves(rig.face(), looks)
    degrees = 0.0 if looks is None else turn_to_front(looks, 0.0, looks, equal=equal)
    turn = turn_about_up(degrees)
    return replace(rig, meshes=tuple(bake_transform(mesh, turn) for mesh in rig.meshes))


def yaw_of(to_rig: FloatArray) -> float:
    """Return by how much a transform (4, 4), for row vectors, turns about y [degrees].

    Of its rotation the twist about that axis, so that another up axis turns nothing; 0 where it has
    none, as of a character that stands on its head. One that is mirrored from left to right is
    turned as before that.
    """
    left, _, right = np.linalg.svd(to_rig[:3, :3])
    rotation = left @ right
    if np.linalg.det(rotation) < 0.0:
        rotation = np.diag([-1.0, 1.0, 1.0]) @ rotation
    _, y, _, w = Rotation.from_matrix(rotation.T).as_quat()
    return _wrapped(2.0 * float(np.degrees(np.arctan2(y, w)))) if np.hypot(y, w) > _TURNED else 0.0


def turn_to_front(
    looks: float, yaw: float, own: float | None = None, *, equal: bool = False
) -> float:
    """Return by how much to turn a character about y for its face to look along +z [degrees].

    Parameters
    ----------
    looks : float [degrees]
        `Facing.yaw`: right but for the markers' distribution.
    yaw : float [degrees]
        That the stage turns the character by: exact, but it may only correct the model's axes.
    own : float [degrees], optional
        `Facing.yaw` without markers: of a face with equal halves exact, also where a program has
        applied the turn to the points.
    equal : bool
        The face has equal halves about `own` (`has_equal_halves`).
    """
    turned = yaw if abs(_wrapped(looks - yaw)) <= max(abs(looks), SLIGHT) else 0.0
    if own is not None and equal and abs(_wrapped(own - looks)) <= UNEVEN:
        return -turned if abs(_wrapped(own - turned)) <= SLIGHT else -own
    if abs(_wrapped(looks - turned)) <= UNEVEN:
        return -turned
    along = 90.0 * round(looks / 90.0)
    known = own is not None and abs(_wrapped(own - looks)) <= _ALONG
    if own is not None and known and abs(_wrapped(own - along)) > SLIGHT:
        return -own
    return -along if abs(looks - along) <= _ALONG else 0.0


def turn_about_up(degrees: float) -> FloatArray:
    """Return the transform (4, 4) of a turn about y, for row vectors."""
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_euler("y", degrees, degrees=True).as_matrix().T
    return matrix


def _wrapped(degrees: float) -> float:
    """Return an angle within half a turn of 0."""
    return (degrees + 180.0) % 360.0 - 180.0
