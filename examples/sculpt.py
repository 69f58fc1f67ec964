"""The head's form as a signed distance field, and the curves of its eyes and mouth.

Metres, Y up, the face looks to +Z, the character's left is +X. Points are folded to x >= 0,
so the form is its own mirror image.
"""

from collections.abc import Callable

import numpy as np

from usdface.arrays import FloatArray

__all__ = [
    "EYE",
    "EYE_RADIUS",
    "LID",
    "distance",
    "gradient",
    "lid_curve",
    "lip_curve",
    "march",
    "project",
    "scalp",
]

EYE = np.array([0.0355, 0.0000, 0.0555])
EYE_RADIUS = 0.0215
LID = 0.0022  # thickness of a lid over the eyeball
MOUTH_HALF = 0.0245
MOUTH_Y = -0.0665


def _ellipsoid(p: FloatArray, centre: tuple[float, ...], radii: tuple[float, ...]) -> FloatArray:
    q = p - centre
    once = np.linalg.norm(q / radii, axis=1)
    twice = np.linalg.norm(q / np.square(radii), axis=1)
    return np.asarray(once * (once - 1) / np.maximum(twice, 1e-9))


def _cone(
    p: FloatArray, a: tuple[float, ...], b: tuple[float, ...], ra: float, rb: float
) -> FloatArray:
    axis = np.subtract(b, a)
    along = np.clip((p - a) @ axis / (axis @ axis), 0, 1)
    away = np.linalg.norm(p - a - along[:, None] * axis, axis=1)
    return np.asarray(away - (ra + (rb - ra) * along))


def _join(a: FloatArray, b: FloatArray, soft: float) -> FloatArray:
    near = np.maximum(soft - np.abs(a - b), 0) / soft
    return np.minimum(a, b) - near**2 * soft / 4


def _carve(a: FloatArray, b: FloatArray, soft: float) -> FloatArray:
    return -_join(-a, b, soft)


def lip_curve(x: FloatArray) -> FloatArray:
    """Return the height [m] of the closed mouth line at `x` [m]; its corners turn up a little."""
    s = np.clip(np.abs(x) / MOUTH_HALF, 0, 1.3)
    return MOUTH_Y - 0.0008 * np.cos(np.pi * s * 1.6) + 0.0018 * s**3


def lid_curve(t: FloatArray, upper: bool) -> FloatArray:
    """Return the rim of a lid as seen from the front: offsets (N, 2) [m] from the eye's centre.

    `t` runs from -1 at the inner to 1 at the outer corner.
    """
    x = 0.0188 * np.sin(t * np.pi / 2)
    arch = np.sqrt(np.maximum(1 - np.abs(np.sin(t * np.pi / 2)) ** 2.3, 0))
    skew = 1 + (0.02 if upper else 0.16) * np.sin(t * np.pi / 2)
    y = (0.0112 if upper else -0.0092) * arch * skew + 0.0018 * t - 0.0006
    return np.stack([x, y], axis=-1)


def _lips(p: FloatArray) -> tuple[FloatArray, FloatArray]:
    x, y, z = p.T
    s = np.clip(np.abs(x) / (MOUTH_HALF + 0.001), 0, 1)
    taper = np.sqrt(1 - s**2) * 0.75 + 0.25
    front = 0.0872 - 0.0140 * s**2
    bow = 0.0008 * np.cos(np.pi * np.clip(np.abs(x) / 0.010, 0, 1))  # dip of the upper lip
    upper = np.hypot(y - lip_curve(x) - 0.0036 * taper + bow, z - front) - 0.0042 * taper
    lower = np.hypot(y - lip_curve(x) + 0.0044 * taper, z - front + 0.0006) - 0.0051 * taper
    beyond = np.maximum(np.abs(x) - MOUTH_HALF, 0)
    return np.hypot(upper, beyond), np.hypot(lower, beyond)


def _skull(p: FloatArray) -> FloatArray:
    cranium = _ellipsoid(p, (0, 0.036, -0.016), (0.0765, 0.087, 0.092))
    face = _ellipsoid(p, (0, -0.034, 0.010), (0.0675, 0.079, 0.072))
    return _join(cranium, face, 0.05)


def scalp(points: FloatArray) -> FloatArray:
    """Return the signed distance (N,) to the skull without features, which hair sits on."""
    folded = np.abs(points * (1, 0, 0)) + points * (0, 1, 1)
    return _skull(folded)


def distance(points: FloatArray) -> FloatArray:
    """Return the (nearly) signed distance (N,) [m] of points (N, 3) to the skin."""
    p = np.abs(points * (1, 0, 0)) + points * (0, 1, 1)
    d = _skull(p)
    d = _join(d, _cone(p, (0, -0.04, -0.028), (0, -0.20, -0.040), 0.038, 0.043), 0.030)
    d = _join(d, _ellipsoid(p, (0, -0.0985, 0.0605), (0.023, 0.0175, 0.0225)), 0.028)
    d = _join(d, _ellipsoid(p, (0.035, -0.036, 0.050), (0.028, 0.025, 0.024)), 0.025)
    d = _join(d, _cone(p, (0.010, 0.026, 0.071), (0.046, 0.027, 0.052), 0.008, 0.009), 0.022)
    d = _join(d, _ellipsoid(p, (0, -0.068, 0.052), (0.032, 0.027, 0.034)), 0.022)
    d = _carve(d, np.linalg.norm(p - (0.0345, 0.003, 0.0930), axis=1) - 0.021, 0.024)
    d = _join(d, np.linalg.norm(p - EYE, axis=1) - EYE_RADIUS - LID, 0.006)
    d = _join(d, _cone(p, (0, 0.010, 0.0760), (0, -0.028, 0.0930), 0.0060, 0.0080), 0.014)
    d = _join(d, _ellipsoid(p, (0, -0.0330, 0.0975), (0.0118, 0.0105, 0.0118)), 0.010)
    d = _join(d, _ellipsoid(p, (0.0110, -0.0375, 0.0880), (0.0064, 0.0070, 0.0095)), 0.008)
    upper, lower = _lips(p)
    d = _join(d, upper, 0.005)
    return _join(d, lower, 0.005)


def gradient(
    points: FloatArray, field: Callable[[FloatArray], FloatArray] = distance
) -> FloatArray:
    """Return the field's gradient (N, 3), by central differences."""
    step = 2e-4 * np.eye(3)
    slopes = [field(points + h) - field(points - h) for h in step]
    return np.asarray(np.stack(slopes, axis=1) / 4e-4)


def project(
    points: FloatArray, field: Callable[[FloatArray], FloatArray] = distance, rounds: int = 3
) -> FloatArray:
    """Move points (N, 3) to the field's zero along its gradient."""
    for _ in range(rounds):
        slope = gradient(points, field)
        size = np.maximum((slope**2).sum(axis=1), 0.25)
        points = points - (field(points) / size)[:, None] * slope
    return points


def march(
    origins: FloatArray,
    directions: FloatArray,
    field: Callable[[FloatArray], FloatArray] = distance,
    reach: float = 0.35,
) -> FloatArray:
    """Return where rays from far outside back to `origins` (N, 3) first meet the surface."""
    left = np.full(len(origins), reach)
    for _ in range(90):
        left = left - 0.7 * field(origins + left[:, None] * directions)
    return np.asarray(origins + np.maximum(left, 0)[:, None] * directions)
