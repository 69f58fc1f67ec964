"""Parts in and on the head: eyes, brows, teeth, tongue, ears, hair."""

from dataclasses import dataclass

import numpy as np

from examples.sculpt import EYE, EYE_RADIUS, gradient, march, scalp
from examples.topology import FLIP
from usdface.arrays import FloatArray

__all__ = ["Part", "brow", "ear", "eye", "hair", "mirrored", "teeth", "tongue"]

# Elevation of the hair's edge [degree] by angle around the head [degree], front to nape.
HAIRLINE = (
    (0, 18, 35, 48, 58, 68, 78, 85, 92, 100, 112, 128, 150, 181, 221),
    (34, 33, 29, 22, 10, -10, -24, -24, -6, 6, 2, -22, -38, -42, -42),
)


@dataclass(frozen=True, eq=False)
class Part:
    """A closed little mesh: points (V, 3) [m], faces, and a material for each face."""

    points: FloatArray
    faces: list[tuple[int, ...]]
    materials: list[str]


def mirrored(part: Part) -> Part:
    """Return the part on the other side."""
    return Part(part.points * FLIP, [face[::-1] for face in part.faces], part.materials)


def _lathe(rings: FloatArray, start: FloatArray | None, end: FloatArray | None) -> Part:
    """Join rings (R, L, 3) to a tube, closed by fans to `start` and `end`.

    Rings run counter-clockwise as seen from the end of the tube's axis that they come from.
    """
    count, loop = rings.shape[:2]
    points = [rings.reshape(-1, 3)]
    ids = np.arange(count * loop).reshape(count, loop)
    following = np.roll(ids, -1, axis=1)
    quads = np.stack([ids[:-1], ids[1:], following[1:], following[:-1]], axis=-1).reshape(-1, 4)
    faces = [tuple(int(v) for v in quad) for quad in quads]
    total = count * loop
    for tip, ring, turned in ((start, 0, False), (end, -1, True)):
        if tip is not None:
            points.append(tip[None])
            for a, b in zip(ids[ring], following[ring], strict=True):
                fan = (total, int(a), int(b))
                faces.append(fan[::-1] if turned else fan)
            total += 1
    return Part(np.concatenate(points), faces, [])


def _painted(part: Part, materials: list[str]) -> Part:
    return Part(part.points, part.faces, materials)


def eye() -> Part:
    """Build the left eyeball; its axis is the line of sight (+Z)."""
    polar = np.radians([10, 12, 19, 23.5, 26, 40, 58, 76, 95, 120, 150])
    around = np.radians(np.arange(0, 360, 15))
    rings = np.stack(
        [
            np.sin(polar)[:, None] * np.cos(around),
            np.sin(polar)[:, None] * np.sin(around),
            np.broadcast_to(np.cos(polar)[:, None], (len(polar), len(around))),
        ],
        axis=-1,
    )
    pole = np.array([0, 0, EYE_RADIUS])
    ball = _lathe(EYE_RADIUS * rings, pole, -pole)
    inward = np.radians(-2.5)  # eyes that look at somebody near converge
    turn = np.array(
        [[np.cos(inward), 0, np.sin(inward)], [0, 1, 0], [-np.sin(inward), 0, np.cos(inward)]]
    )
    ball = Part(EYE + ball.points @ turn.T, ball.faces, [])
    bands = ["pupil", "iris", "iris", "limbus"] + ["sclera"] * 6
    loop = len(around)
    materials = [band for band in bands for _ in range(loop)] + ["pupil"] * loop + ["sclera"] * loop
    return _painted(ball, materials)


def _tube(
    centres: FloatArray, side: FloatArray, up: FloatArray, loop: int, square: float = 1.0
) -> Part:
    """Sweep an ellipse with half axes `side`, `up` (N, 3) along `centres` (N, 3)."""
    around = np.linspace(0, 2 * np.pi, loop, endpoint=False) + np.pi / loop
    c, s = np.cos(around), np.sin(around)
    c, s = (np.sign(w) * np.abs(w) ** square for w in (c, s))
    rings = centres[:, None] + c[:, None] * side[:, None] + s[:, None] * up[:, None]
    return _lathe(rings, centres[0], centres[-1])


def brow() -> Part:
    """Build the left brow: a tapered bar along the brow ridge."""
    s = np.linspace(0, 1, 14)
    x = 0.0125 + 0.0450 * s
    y = 0.0340 + 0.0075 * np.sin(np.pi * s**1.15 * 0.92) - 0.0045 * s**2
    origins = np.column_stack([x, y, np.full(len(s), 0.01)])
    centres = march(origins, np.broadcast_to((0.0, 0.0, 1.0), origins.shape))
    normal = gradient(centres)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    along = np.gradient(centres, axis=0)
    up = np.cross(normal, along)
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    taper = np.sqrt(np.clip(np.minimum((s + 0.02) / 0.12, (1.03 - s) / 0.75), 0, 1))[:, None]
    part = _tube(centres + 0.0005 * normal, 0.0019 * taper * normal, 0.0042 * taper * up, 8)
    return _painted(part, ["brow"] * len(part.faces))


def teeth(upper: bool) -> Part:
    """Build a row of teeth as one bar."""
    angle = np.radians(np.linspace(-68, 68, 19))
    size = 1.0 if upper else 0.93
    y = -0.0635 if upper else -0.0735
    centres = np.column_stack(
        [
            0.0255 * size * np.sin(angle),
            np.full(len(angle), y),
            0.0450 + 0.0345 * size * np.cos(angle),
        ]
    )
    outward = np.column_stack([np.sin(angle), 0 * angle, np.cos(angle)])
    up = np.broadcast_to((0.0, 0.0055, 0.0), centres.shape)
    part = _tube(centres, 0.0024 * outward, up, 8, square=0.6)
    return _painted(part, ["teeth"] * len(part.faces))


def tongue() -> Part:
    """Build the tongue: a flattened bar from the throat to the tip behind the lower teeth."""
    s = np.linspace(0, 1, 10)
    width = 0.0155 * np.sqrt(np.clip(1.02 - s**4, 0, 1))
    thick = 0.0060 * np.sqrt(np.clip(1.04 - s**3, 0, 1))
    centres = np.column_stack([0 * s, -0.0765 + 0.004 * s * (1 - s) * 4, 0.025 + 0.0475 * s])
    side = np.column_stack([width, 0 * s, 0 * s])
    up = np.column_stack([0 * s, thick, 0 * s])
    part = _tube(centres, side, up, 12)
    faces = [face[::-1] for face in part.faces]
    return Part(part.points, faces, ["tongue"] * len(faces))


def ear() -> Part:
    """Build the left ear: a bowl with a rolled rim, rooted in the head."""
    around = np.radians(np.arange(0, 360, 18))
    outline = 1 + 0.10 * np.sin(around) - 0.06 * np.cos(around)
    rings = []
    for radius, height in (
        (0.25, 0.0010),
        (0.50, 0.0020),
        (0.70, 0.0060),
        (0.84, 0.0105),
        (0.96, 0.0115),
        (1.00, 0.0095),
        (0.93, 0.0055),
        (0.75, -0.0040),
        (0.60, -0.0140),
    ):
        forward = 0.0165 * radius * outline * np.cos(around)
        rise = 0.0270 * radius * outline * np.sin(around)
        rings.append(np.stack([forward, rise, np.full(len(around), height)], axis=-1))
    lean, flare = np.radians(12), np.radians(-24)  # the back of an ear stands off
    forward = np.array([np.sin(flare), 0, np.cos(flare)])
    out = np.array([np.cos(flare), 0, -np.sin(flare)])
    rise = np.array([0, 1.0, 0])
    forward, rise = (
        np.cos(lean) * forward + np.sin(lean) * rise,
        np.cos(lean) * rise - np.sin(lean) * forward,
    )
    local = np.stack(rings)
    placed = local[..., :1] * forward + local[..., 1:2] * rise + local[..., 2:] * out
    placed += (0.0735, 0.000, -0.0160)
    bottom = np.array([0.0735, 0.0, -0.0160]) + 0.0008 * out
    part = _lathe(placed, bottom, None)
    faces = [face[::-1] for face in part.faces]
    return Part(part.points, faces, ["skin"] * len(faces))


def hair() -> Part:
    """Build the hair: a cap of broad locks on the skull, parted on the right, swept left."""
    around = np.linspace(0, 2 * np.pi, 88, endpoint=False)
    turn = np.degrees((around + np.pi) % (2 * np.pi) - np.pi)
    fine = np.arange(-220, 221)
    edge = np.interp(np.abs((fine + 180) % 360 - 180), HAIRLINE[0], HAIRLINE[1])
    window = np.hanning(15) / np.hanning(15).sum()
    line = np.interp(turn, fine, np.convolve(np.pad(edge, 7, "edge"), window, "valid"))
    line += 9 * np.exp(-(((turn + 24) / 14) ** 2)) - 5 * np.exp(-(((turn - 14) / 20) ** 2))
    share = np.linspace(0.06, 1, 13)[:, None]
    sweep = 0.9 * np.exp(-((turn / 70) ** 2)) * (1 - share)  # locks turn towards the part
    lock = np.abs(np.cos(6.5 * (around + sweep) + 0.4)) ** 0.6
    tilt = np.radians(90 - share * (90 - line + 3 * (lock[-1] - 0.5)))
    direction = np.stack(
        [np.sin(around) * np.cos(tilt), np.sin(tilt), np.cos(around) * np.cos(tilt)], axis=-1
    )
    centre = np.array([0, 0.036, -0.016])
    flat = direction.reshape(-1, 3)
    skull = march(np.broadcast_to(centre, flat.shape), flat, scalp)
    normal = gradient(skull, scalp)
    normal = (normal / np.linalg.norm(normal, axis=1, keepdims=True)).reshape(direction.shape)
    front = np.exp(-(((turn - 12) / 50) ** 2))
    thick = 0.0085 - 0.0030 * share**4 + 0.0075 * front * np.sin(np.pi * share**1.6)
    thick = thick + 0.0026 * (lock - 0.6) * np.clip(share * 2.2, 0, 1)
    skull = skull.reshape(direction.shape)
    outer = skull + thick[..., None] * normal
    tuck = skull[-1:] - 0.004 * normal[-1:] + (0, 0.002, 0)
    crown = centre + np.array([0, 0.087 + 0.0085, 0])
    part = _lathe(np.concatenate([outer, tuck]), crown, None)
    return _painted(part, ["hair"] * len(part.faces))
