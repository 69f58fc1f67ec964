"""A face with two eyes that turn on joints of their own, as VRM's and MakeHuman's do."""

from dataclasses import replace

import numpy as np

from usdface.rigs import Mesh, Rig, Skeleton, Skin

__all__ = ["EYE_PLACES", "with_eyes"]

EYE_PLACES = np.array([[0.03, 0.03, -0.02], [-0.03, 0.03, -0.02]])  # left, right
_HEAD = np.array([0.0, -0.05, -0.05])
_RADIUS = 0.012
_CORNERS = np.array(np.meshgrid(*[[-1.0, 1.0]] * 3, indexing="ij")).reshape(3, -1).T
_SIDES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]


def with_eyes(rig: Rig, names: tuple[str, str] = ("LeftEye", "RightEye")) -> Rig:
    """Return the rig of a face with a head's joint below a neck's, and below that two eyes."""
    joints = ("neck", "neck/head", "neck/head/eyeL", "neck/head/eyeR")
    bind = np.tile(np.eye(4), (4, 1, 1))
    bind[1, 3, :3] = _HEAD
    bind[2:, 3, :3] = EYE_PLACES
    rest = bind.copy()
    rest[2:, 3, :3] -= _HEAD
    face = rig.meshes[0]
    skinned = replace(face, skin=_skin(1, len(face.points)))
    eyes = [
        Mesh(
            name,
            place + _RADIUS * _CORNERS,
            [4] * 6,
            np.ravel(_SIDES),
            skin=_skin(2 + i, len(_CORNERS)),
        )
        for i, (name, place) in enumerate(zip(("eye_l", "eye_r"), EYE_PLACES, strict=True))
    ]
    skeleton = Skeleton(joints, ("Neck", "Head", *names), bind, rest)
    return replace(rig, meshes=(skinned, *eyes), skeleton=skeleton)


def _skin(joint: int, count: int) -> Skin:
    return Skin(np.full((count, 1), joint), np.ones((count, 1)))
