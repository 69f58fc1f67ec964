"""The 52 ARKit blend shapes of the head: offsets in metres at weight 1.

Lips and lids are led along their loops; the skin between follows elastically over the mesh,
so what is close in space but not along the skin (the other lip) stays where it is. Names and
meanings are those of Apple's ``ARFaceAnchor.BlendShapeLocation``.
"""

import numpy as np
from numpy.typing import NDArray

from examples.rings import POCKET_RINGS
from examples.sculpt import EYE
from examples.skin import MM, Skin, smooth
from examples.topology import FLIP, HeadMesh
from usdface.arrays import FloatArray

__all__ = ["ARKIT_NAMES", "HINGE", "JAW_ANGLE", "eye_turns", "head_shapes", "jaw_moves"]

ARKIT_NAMES = (
    *("browDownLeft", "browDownRight", "browInnerUp", "browOuterUpLeft", "browOuterUpRight"),
    *("cheekPuff", "cheekSquintLeft", "cheekSquintRight"),
    *("eyeBlinkLeft", "eyeBlinkRight", "eyeLookDownLeft", "eyeLookDownRight"),
    *("eyeLookInLeft", "eyeLookInRight", "eyeLookOutLeft", "eyeLookOutRight"),
    *("eyeLookUpLeft", "eyeLookUpRight", "eyeSquintLeft", "eyeSquintRight"),
    *("eyeWideLeft", "eyeWideRight", "jawForward", "jawLeft", "jawOpen", "jawRight"),
    *("mouthClose", "mouthDimpleLeft", "mouthDimpleRight", "mouthFrownLeft", "mouthFrownRight"),
    *("mouthFunnel", "mouthLeft", "mouthLowerDownLeft", "mouthLowerDownRight"),
    *("mouthPressLeft", "mouthPressRight", "mouthPucker", "mouthRight", "mouthRollLower"),
    *("mouthRollUpper", "mouthShrugLower", "mouthShrugUpper", "mouthSmileLeft"),
    *("mouthSmileRight", "mouthStretchLeft", "mouthStretchRight", "mouthUpperUpLeft"),
    *("mouthUpperUpRight", "noseSneerLeft", "noseSneerRight", "tongueOut"),
)
HINGE = np.array([0.0, -0.010, 0.000])
JAW_ANGLE = np.radians(19)
# Rotation of the eyeball [degree] about x (down positive) and y (to +X positive), left eye.
GAZE = {
    "eyeLookDownLeft": (24, 0),
    "eyeLookUpLeft": (-20, 0),
    "eyeLookInLeft": (0, -28),
    "eyeLookOutLeft": (0, 28),
}


def _turned(
    points: FloatArray, centre: FloatArray, about_x: float, about_y: float = 0.0
) -> FloatArray:
    """Return the displacement of points turned about x, then y [rad]."""
    cx, sx, cy, sy = np.cos(about_x), np.sin(about_x), np.cos(about_y), np.sin(about_y)
    rx = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    ry = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    return np.asarray((points - centre) @ (ry @ rx).T + centre - points)


def jaw_moves(points: FloatArray) -> dict[str, FloatArray]:
    """Return how points fixed to the jaw move in the four jaw shapes: name to (V, 3) [m]."""
    return {
        "jawForward": np.broadcast_to((0, 0, 7 * MM), points.shape),
        "jawLeft": np.broadcast_to((8 * MM, 0, 0), points.shape),
        "jawOpen": _turned(points, HINGE, JAW_ANGLE),
        "jawRight": np.broadcast_to((-8 * MM, 0, 0), points.shape),
    }


def eye_turns(points: FloatArray) -> dict[str, FloatArray]:
    """Return how points of the left eyeball move in its four gaze shapes: name to (V, 3) [m]."""
    return {
        name: _turned(points, EYE, np.radians(down), np.radians(out))
        for name, (down, out) in GAZE.items()
    }


def _jaw_share(skin: Skin) -> FloatArray:
    """Return how much of the jaw's motion each vertex takes (V,)."""
    x, y, z = skin.points.T
    targets, firm = np.zeros((len(x), 3)), np.zeros(len(x))
    firm[(y > -0.030) | (y < -0.150) | (z < -0.02)] = 10
    firm[(y > -0.052) & (np.abs(x) < 0.022)] = 10
    chin = (y < -0.083) & (z > 0.030) & (y > -0.125)
    targets[chin], firm[chin] = 1, 10
    corner = 0.40
    lower = corner + (1 - corner) * smooth(1.25 * skin.rise)
    upper = corner * (1 - smooth(1.6 * skin.rise))
    loop = skin.upper * upper + (1 - skin.upper) * lower
    for ring in skin.lips:
        targets[ring], firm[ring] = loop[:, None], 30
    for ring in skin.sock:
        targets[ring], firm[ring] = (1 - skin.upper)[:, None] * 0.9, 1
    return skin.spread(targets, firm)[:, 0]


def _jaw(skin: Skin) -> dict[str, FloatArray]:
    share = _jaw_share(skin)[:, None]
    shapes = {name: share * move for name, move in jaw_moves(skin.points).items()}
    narrow = skin.along(np.sign(skin.side) * np.abs(skin.side) ** 3, -3, 0, 0)
    shapes["jawOpen"] = shapes["jawOpen"] + skin.mouth(narrow, narrow)
    # mouthClose takes the lips of the open jaw back together, the chin stays down.
    opened = shapes["jawOpen"][skin.lips]
    facing = np.roll(opened[:, ::-1], 1, axis=1)
    gap = facing - opened  # to the vertex of the other lip
    close = gap[2]
    shapes["mouthClose"] = skin.mouth(
        0.35 * close, 0.65 * close, skin.points[:, 1] < -0.094, (0.5, 0.9, 1, 1, 0.95, 0.8)
    )
    return shapes


def _lids(skin: Skin) -> dict[str, FloatArray]:
    """Return the shapes of the left lids."""
    eye = skin.points[skin.lids[POCKET_RINGS]][:, :2] - EYE[:2]
    loop = len(eye)
    other = np.roll(eye[::-1], 1, axis=0)  # the facing vertex of the other lid
    gap = other - eye
    opening = np.linalg.norm(gap, axis=1, keepdims=True)
    mid = np.sin(np.pi * np.arange(loop) / (loop // 2))
    arch = np.abs(mid)[:, None]
    up = np.array([0, MM])

    def rims(upper: float, lower: float) -> FloatArray:
        return skin.lid(upper * arch * up, lower * arch * up)

    look_sideways = np.array([1.2 * MM, 0])
    return {
        "eyeBlinkLeft": skin.lid(0.72 * gap, 0.28 * gap, MM * np.minimum(opening / 0.011, 1)),
        "eyeLookDownLeft": rims(-4.2, -1.2),
        "eyeLookUpLeft": rims(2.6, 0.8),
        "eyeLookInLeft": skin.lid(-arch * look_sideways, -arch * look_sideways),
        "eyeLookOutLeft": skin.lid(arch * look_sideways, arch * look_sideways),
        "eyeSquintLeft": rims(-1.4, 4.6)
        + skin.bump((0.036, -0.022, 0.072), (0.014, 0.007, 0.02), 0, 2.0, 1.2),
        "eyeWideLeft": rims(4.2, -1.8),
    }


def _brows_and_cheeks(skin: Skin) -> dict[str, FloatArray]:
    bump = skin.bump
    inner, outer = (0.016, 0.036, 0.072), (0.048, 0.036, 0.056)
    middle = (0.031, 0.038, 0.068)
    wide = (0.010, 0.011, 0.03)
    return {
        "browDownLeft": bump(inner, (0.011, 0.012, 0.03), -3.2, -8.6, 1.8)
        + bump(middle, wide, -1.4, -4.2, 1.0)
        + bump(outer, wide, -0.4, -1.6, 0.2),
        "browInnerUp": bump(inner, (0.012, 0.014, 0.03), -1.0, 10.0, 0.6)
        + bump(inner, (0.012, 0.014, 0.03), -1.0, 10.0, 0.6)[skin.mirror] * FLIP,
        "browOuterUpLeft": bump(outer, (0.013, 0.013, 0.03), 0.3, 8.0, 0)
        + bump(middle, (0.010, 0.012, 0.03), 0.1, 4.8, 0.3),
        "cheekPuff": bump((0.047, -0.060, 0.052), (0.016, 0.016, 0.024), 8, 0, 7)
        + bump((-0.047, -0.060, 0.052), (0.016, 0.016, 0.024), -8, 0, 7),
        "cheekSquintLeft": bump((0.041, -0.032, 0.068), (0.016, 0.011, 0.025), 0.8, 4.0, 3.2),
    }


def _mouth(skin: Skin) -> dict[str, FloatArray]:  # a table: one entry per shape
    along, s, rise, bump = skin.along, skin.side, skin.rise, skin.bump
    corner = smooth(s) ** 0.9  # left corner 1, middle 0
    wide, curl = np.clip(s, 0, 1) ** 1.2, np.clip(s, 0, 1) ** 2.2
    half = smooth((s + 0.45) / 0.9) * rise**0.7  # the left half of a lip, corners still
    lip = rise**0.8
    none = along(0 * s, 0, 0, 0)

    def both(profile: FloatArray, *mm: float, hold: NDArray[np.bool_] | None = None) -> FloatArray:
        return skin.mouth(along(profile, *mm), along(profile, *mm), hold)

    chin = skin.points[:, 1] < -0.092
    pull = np.sign(s) * np.abs(s) ** 1.2
    round_lips = along(pull, -11, 0, 0) + along(np.abs(s) ** 2, 0, 0, 6)
    smile_cheek = bump((0.043, -0.038, 0.064), (0.015, 0.013, 0.025), 1.8, 4.2, 4.2)
    roll = (0.5, 0.8, 1.0, 0.95, 0.55, 0.12)
    return {
        "mouthSmileLeft": skin.mouth(
            along(wide, 10.5, 0, -8) + along(curl, 0, 10.0, 0) + along(half, 0, 1.0, 0),
            along(wide, 10.5, 0, -8) + along(curl, 0, 10.0, 0) + along(half, 0, 0.4, 0),
        )
        + smile_cheek,
        "mouthFrownLeft": both(wide, 2.5, 0, -2.0) + both(curl, 0, -11.0, 0),
        "mouthDimpleLeft": both(wide, 7.5, 1.2, -8.5),
        "mouthStretchLeft": skin.mouth(
            along(corner, 8, -1.5, -5), along(corner, 8, -1.5, -5) + along(half, 1, -3.0, 0)
        ),
        "mouthUpperUpLeft": skin.mouth(along(half, 0, 6.0, 0.6), none),
        "mouthLowerDownLeft": skin.mouth(none, along(half, 0, -6.5, 0.2)),
        "mouthPressLeft": skin.mouth(
            along(half, 0, -1.0, -1.6), along(half, 0, 1.0, -1.6), None, roll
        )
        + both(corner, 2.0, 0.8, -2.0),
        "mouthLeft": both(0.35 + 0.65 * smooth(1.2 * (s + 1) / 2), 9, 0, -1.0),
        "mouthPucker": skin.mouth(
            round_lips + along(lip, 0, 1.0, 6.5), round_lips + along(lip, 0, -1.0, 6.5)
        ),
        "mouthFunnel": skin.mouth(
            0.75 * round_lips + along(lip, 0, 4.6, 6), 0.75 * round_lips + along(lip, 0, -6.0, 5.5)
        ),
        "mouthRollLower": skin.mouth(none, along(lip, 0, 2.6, -5.0), chin, roll),
        "mouthRollUpper": skin.mouth(along(lip, 0, -2.6, -5.0), none, None, roll),
        "mouthShrugLower": skin.mouth(along(lip, 0, 2.2, 1.6), along(lip, 0, 4.8, 3.2))
        + bump((0, -0.094, 0.084), (0.014, 0.010, 0.02), 0, 2.6, 1.6),
        "mouthShrugUpper": both(lip, 0, 3.8, 2.2),
        "noseSneerLeft": skin.mouth(along(half, 0, 3.0, 0.8), none)
        + bump((0.0135, -0.034, 0.090), (0.007, 0.010, 0.015), 1.2, 5.0, 1.0)
        + bump((0.014, 0.006, 0.070), (0.008, 0.014, 0.02), -0.6, 1.2, 1.4)
        + bump((0.016, 0.034, 0.072), (0.010, 0.009, 0.03), -1.4, -3.8, 0.8),
        "tongueOut": np.zeros_like(skin.points),
    }


def _faded(offsets: FloatArray) -> FloatArray:
    """Let what is too small to see go to zero without a step."""
    size = np.linalg.norm(offsets, axis=1, keepdims=True)
    return offsets * smooth((size / MM - 0.07) / 0.23)


def head_shapes(head: HeadMesh) -> dict[str, FloatArray]:
    """Return the offsets (V, 3) [m] of all 52 shapes on the head's vertices, in ARKit's order.

    A shape of the right side is the exact mirror of the left one; the others are their own.
    """
    skin = Skin(head)
    made = {**_jaw(skin), **_lids(skin), **_brows_and_cheeks(skin), **_mouth(skin)}

    def flipped(offsets: FloatArray) -> FloatArray:
        return np.asarray(offsets[head.mirror] * FLIP)

    shapes: dict[str, FloatArray] = {}
    for name in ARKIT_NAMES:
        if name.endswith("Right"):
            shapes[name] = flipped(shapes[name.removesuffix("Right") + "Left"])
        elif name.endswith("Left"):
            shapes[name] = _faded(made[name])
        else:
            shapes[name] = _faded((made[name] + flipped(made[name])) / 2)
    return shapes
