"""The loops of the eyes and the mouth: where their rings of vertices lie."""

import numpy as np

from examples.sculpt import EYE, EYE_RADIUS, MOUTH_HALF, lid_curve, lip_curve, march
from usdface.arrays import FloatArray

__all__ = ["LIP_RINGS", "POCKET_RINGS", "SOCK_RINGS", "eye_rings", "front_of", "mouth_rings"]

LIP_RINGS = 4  # rim, two on the red, border
SOCK_RINGS, POCKET_RINGS = 5, 3  # behind the lips, behind the lids


def front_of(xy: FloatArray) -> FloatArray:
    """Return the points (N, 3) of the skin seen from the front at xy (N, 2)."""
    origins = np.column_stack([xy, np.full(len(xy), 0.02)])
    return march(origins, np.broadcast_to((0.0, 0.0, 1.0), origins.shape))


def eye_rings(loop: int) -> tuple[list[FloatArray], list[FloatArray]]:
    """Return the left eye's rings from the rim outwards, and those behind the lids."""
    half = loop // 2
    t = np.concatenate([np.linspace(-1, 1, half + 1), np.linspace(1, -1, half + 1)[1:-1]])
    is_upper = np.arange(loop) <= half
    rim = np.where(is_upper[:, None], lid_curve(t, True), lid_curve(t, False))
    tangent = np.roll(rim, -1, axis=0) - np.roll(rim, 1, axis=0)
    outward = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)

    def on_ball(xy: FloatArray, radius: float) -> FloatArray:
        flat = np.minimum(1, 0.98 * radius / np.linalg.norm(xy, axis=1))[:, None] * xy
        z = np.sqrt(radius**2 - (flat**2).sum(axis=1))
        return np.asarray(EYE + np.column_stack([flat, z]))

    front = [on_ball(rim, EYE_RADIUS + 0.0011)]
    for upper, lower in ((0.0008, 0.0008), (0.0030, 0.0026), (0.0058, 0.0052)):
        reach = np.where(is_upper, upper, lower) * (1 - 0.45 * np.exp(-4 * (t + 1)))
        front.append(front_of(EYE[:2] + rim + reach[:, None] * outward))
    behind = [on_ball(rim + d * outward, EYE_RADIUS + 0.0010) for d in (0.0012, 0.003, 0.005)]
    return front, behind


def mouth_rings(loop: int) -> tuple[list[FloatArray], list[FloatArray]]:
    """Return the rings of the lips from the rim outwards, and those of the mouth's inside."""
    half = loop // 2
    angle = np.pi * np.arange(loop) / half  # 0 = right corner, pi = left corner
    upper = np.arange(loop) <= half
    x = -MOUTH_HALF * np.cos(angle)
    rim = np.column_stack([x, lip_curve(x)])
    side, rise = -np.cos(angle), np.sin(angle)
    bow = (
        1 - 0.10 * np.exp(-((x / 0.003) ** 2)) + 0.06 * np.exp(-(((np.abs(x) - 0.006) / 3e-3) ** 2))
    )
    front = []
    for corner, up, down in (
        (0.0, 0.0, 0.0),
        (0.0007, 0.0018, 0.0020),
        (0.0015, 0.0046, 0.0056),
        (0.0026, 0.0072, 0.0088),
    ):
        lift = np.where(upper, up * bow, down) * rise
        lift += 0.12 * corner * np.where(upper, 1, -1) * (1 - rise**2)
        front.append(front_of(rim + np.column_stack([corner * side, lift])))
    front[0] = front[0] - (0, 0, 0.0012)
    front[1] = front[1] - (0, 0, 0.0002)
    inside = []
    for back, rises in (
        (0.003, 0.0004),
        (0.007, 0.0060),
        (0.014, 0.0110),
        (0.030, 0.0130),
        (0.042, 0.0080),
    ):
        narrow = np.column_stack([front[0][:, 0] * (1 - back * 4), rises * rise, 0 * x - back])
        inside.append(front[0] * (0, 1, 1) + narrow)
    return front, inside
