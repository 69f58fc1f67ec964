"""The joints of a skeleton that turn the eyes."""

from collections.abc import Iterable

import numpy as np

from usdface.arrays import FloatArray
from usdface.face.gaze_curves import Side, gaze_shapes_of
from usdface.face.shape_names import split_words
from usdface.rigs import Mesh, Rig

__all__ = ["eye_joints", "is_turned_by_shapes"]

_SIDES: dict[str, Side] = {"l": "left", "left": "left", "r": "right", "right": "right"}
# Words of an eye's joint beside its side: those that rigs of Blender, Character Creator, Daz,
# MetaHuman, Mixamo and VRoid have, and general ones.
_BESIDE = frozenset(
    ("adj", "b", "ball", "base", "bind", "bip", "biped", "bn", "bone", "c", "cc", "char", "def")
).union(("face", "facial", "head", "j", "jnt", "joint", "mixamorig", "rig", "skin", "valve"))
_EYES = frozenset(("eye", "eyeball"))
# A vertex is the eye's if its joint has more than this share of it.
_OWN = 0.5
# A blend shape turns an eye if it moves a vertex of it by this share of the eye's size: 10 degrees
# move the pupil by 0.09. By hand.
_MOVED = 0.05


def eye_joints(rig: Rig) -> dict[Side, int]:
    """Return the joint of each eye, by its name; of several that which has the most skin.

    Examples
    --------
    >>> rig, _ = usdface.read_rig("examples/head.usdc")
    >>> usdface.face.eye_joints.eye_joints(rig)
    {}
    """
    if rig.skeleton is None:
        return {}
    skins = _skin_of_joints(rig.meshes, len(rig.skeleton.joints))
    found: dict[Side, int] = {}
    for joint, name in enumerate(rig.skeleton.names):
        side = _eye_side(name)
        if side and skins[joint] > (skins[found[side]] if side in found else 0.0):
            found[side] = joint
    return found


def is_turned_by_shapes(rig: Rig, joint: int) -> bool:
    """Return whether gaze is a matter of blend shapes: one of gaze turns the eye of a joint."""
    return any(_moves(mesh, joint) for mesh in rig.meshes)


def _moves(mesh: Mesh, joint: int) -> bool:
    if mesh.skin is None:
        return False
    share = np.where(mesh.skin.joints == joint, mesh.skin.weights, 0.0).sum(axis=1)
    own = share > _OWN
    if not own.any():
        return False
    size = float(np.linalg.norm(np.ptp(mesh.points[own], axis=0)))
    turning = gaze_shapes_of(mesh.shape_names)
    for shape in mesh.shapes:
        of_eye = own[shape.indices]
        far = np.linalg.norm(shape.offsets[of_eye], axis=1).max(initial=0.0)
        if far > _MOVED * size and shape.name in turning:
            return True
    return False


def _skin_of_joints(meshes: Iterable[Mesh], count: int) -> FloatArray:
    """Return the skin weight of each of `count` joints, over all meshes: (count,)."""
    skins = np.zeros(count)
    for mesh in meshes:
        if mesh.skin is not None:
            np.add.at(skins, mesh.skin.joints.ravel(), mesh.skin.weights.ravel())
    return skins


def _eye_side(name: str) -> Side | None:
    """Return the side of the eye that a joint is named after; None for lids, brows and others.

    >>> _eye_side("J_Adj_L_FaceEye"), _eye_side("RightEye"), _eye_side("eyelid_L")
    ('left', 'right', None)
    """
    words = [word for word in split_words(name) if not word.isdigit()]
    sides = {_SIDES[word] for word in words if word in _SIDES}
    rest = [word for word in words if word not in _SIDES and word not in _BESIDE]
    return sides.pop() if len(sides) == 1 and len(rest) == 1 and rest[0] in _EYES else None
