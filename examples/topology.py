"""The head's quads: a grid around the head with loops around the eyes and the mouth."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from examples.sculpt import (
    EYE,
    EYE_RADIUS,
    MOUTH_HALF,
    lid_curve,
    lip_curve,
    march,
    project,
)
from usdface.takes import FloatArray, IntArray

__all__ = ["HeadMesh", "build"]

# Columns: angle around the head [degree] on the left half; the right half mirrors them.
COLUMNS = np.array(
    (
        *(0, 2.3, 4.7, 7.3, 12.5, 18, 23.5, 28.5, 33.5, 39, 45, 51, 58, 66, 76, 87, 98),
        *(109, 120, 131, 142, 152, 162, 171, 180),
    )
)
# Rows: height of the ray's origin [m], its depth [m], elevation in front and behind [degree].
ROWS = np.array(
    [
        (0.040, -0.016, 78, 78),
        (0.040, -0.016, 67, 67),
        (0.040, -0.016, 56, 56),
        (0.040, -0.012, 46, 46),
        (0.040, -0.008, 37, 35),
        (0.040, -0.004, 28, 24),
        (0.040, 0.0, 20, 13),
        (0.036, 0.0, 14, 3),
        (0.031, 0.0, 8, 0),
        (0.0265, 0.0, 3.5, 0),  # 9: top of the eye loops
        (0.0180, 0.0, 2, 0),
        (0.0100, 0.0, 0, 0),
        (0.0015, 0.0, 0, 0),
        (-0.0065, 0.0, 0, 0),
        (-0.0140, 0.0, 0, 0),
        (-0.0215, 0.0, 0, 0),  # 15: bottom of the eye loops
        (-0.0275, 0.0, 0, 0),
        (-0.0330, 0.0, 0, 0),
        (-0.0385, 0.0, 0, 0),
        (-0.0440, 0.0, 0, 0),
        (-0.0500, 0.0, 0, 0),  # 20: top of the mouth loops
        (-0.0560, 0.0, 0, 0),
        (-0.0615, 0.0, 0, 0),
        (-0.0670, 0.0, 0, 0),
        (-0.0730, 0.0, 0, 0),
        (-0.0790, 0.0, 0, 0),
        (-0.0855, 0.0, 0, 0),  # 26: bottom of the mouth loops
        (-0.0900, 0.0, -3, 0),
        (-0.0920, 0.0, -10, 0),
        (-0.0920, 0.0, -18, 0),
        (-0.0920, -0.004, -27, 0),
        (-0.0920, -0.010, -38, 0),
        (-0.0940, -0.014, -50, -4),
        (-0.1000, -0.020, -58, -8),
        (-0.1160, -0.026, -48, -8),
        (-0.1320, -0.030, -20, -5),
        (-0.1420, -0.032, 0, 0),
        (-0.1560, -0.034, 0, 0),
        (-0.1700, -0.036, 0, 0),
    ]
)
EYE_ROWS, EYE_COLUMNS = (9, 15), (3, 11)
MOUTH_ROWS, MOUTH_COLUMNS = (20, 26), (-6, 6)
EYE_RINGS, MOUTH_RINGS = 8, 8  # rings between the grid and the rim, the rim included
LIP_RINGS = 4  # rim, two on the red, border
SOCK_RINGS, POCKET_RINGS = 5, 3  # behind the lips, behind the lids


@dataclass(frozen=True, eq=False)
class HeadMesh:
    """The neutral head.

    Attributes
    ----------
    points : (V, 3) [m]
    faces : list of tuple of int
    uvs : (V, 2)
    mirror : (V,)
        The vertex on the other side.
    eyes : two arrays (rings, loop)
        Vertices of the left (+X) and right eye, ring 0 = rim of the lids, outwards; negative
        rings (counted from the end) lie behind the rim. Loop 0 = inner corner, then the upper
        lid, the outer corner at half, then the lower lid.
    mouth : (rings, loop)
        Same for the mouth: loop 0 = right corner, upper lip, left corner, lower lip.
    lips : (P,) bool
        Faces of the red of the lips.
    inner : (P,) bool
        Faces inside the mouth.
    lashes : (P,) bool
        Faces of the rim of the upper lids.
    """

    points: FloatArray
    faces: list[tuple[int, ...]]
    uvs: FloatArray
    mirror: IntArray
    eyes: tuple[IntArray, IntArray]
    mouth: IntArray
    lips: NDArray[np.bool_]
    inner: NDArray[np.bool_]
    lashes: NDArray[np.bool_]


def _rays() -> tuple[FloatArray, FloatArray]:
    """Return origins and directions (rows, columns, 3) of the grid's rays, columns -24 to 23."""
    angle = np.radians(np.concatenate([-COLUMNS[:0:-1], COLUMNS[:-1]]))
    height, depth, front, behind = ROWS.T[:, :, None]
    share = (1 + np.cos(angle)) / 2
    tilt = np.radians(front * share + behind * (1 - share))
    directions = np.stack(
        [np.sin(angle) * np.cos(tilt), np.sin(tilt), np.cos(angle) * np.cos(tilt)], axis=-1
    )
    origins = np.stack(np.broadcast_arrays(0 * tilt, height, depth), axis=-1)
    return origins, directions


def _border(rows: tuple[int, int], columns: tuple[int, int]) -> list[tuple[int, int]]:
    """Return the grid places around a hole, from mid-height of its right side over the top."""
    (top, bottom), (first, last) = rows, columns
    middle = (top + bottom) // 2
    return (
        [(r, first) for r in range(middle, top, -1)]
        + [(top, c) for c in range(first, last)]
        + [(r, last) for r in range(top, bottom)]
        + [(bottom, c) for c in range(last, first, -1)]
        + [(r, first) for r in range(bottom, middle, -1)]
    )


def _front(xy: FloatArray) -> FloatArray:
    """Return the points (N, 3) of the skin seen from the front at xy (N, 2)."""
    origins = np.column_stack([xy, np.full(len(xy), 0.02)])
    return march(origins, np.broadcast_to((0.0, 0.0, 1.0), origins.shape))


def _eye_rings(loop: int) -> tuple[list[FloatArray], list[FloatArray]]:
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
        return EYE + np.column_stack([flat, z])

    front = [on_ball(rim, EYE_RADIUS + 0.0011)]
    for upper, lower in ((0.0008, 0.0008), (0.0030, 0.0026), (0.0058, 0.0052)):
        reach = np.where(is_upper, upper, lower) * (1 - 0.45 * np.exp(-4 * (t + 1)))
        front.append(_front(EYE[:2] + rim + reach[:, None] * outward))
    behind = [on_ball(rim + d * outward, EYE_RADIUS + 0.0010) for d in (0.0012, 0.003, 0.005)]
    return front, behind[:POCKET_RINGS]


def _mouth_rings(loop: int) -> tuple[list[FloatArray], list[FloatArray]]:
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
        front.append(_front(rim + np.column_stack([corner * side, lift])))
    front[0] = front[0] - (0, 0, 0.0012)
    front[1] = front[1] - (0, 0, 0.0002)
    inside = []
    for back, lift in (
        (0.003, 0.0004),
        (0.007, 0.0060),
        (0.014, 0.0110),
        (0.030, 0.0130),
        (0.042, 0.0080),
    ):
        narrow = np.column_stack([front[0][:, 0] * (1 - back * 4), lift * rise, 0 * x - back])
        inside.append(front[0] * (0, 1, 1) + narrow)
    return front, inside[:SOCK_RINGS]


def _strips(rings: IntArray) -> list[tuple[int, ...]]:
    """Return the quads between rings (R, L) that go outwards; counter-clockwise from outside."""
    following = np.roll(rings, -1, axis=1)
    quads = np.stack([rings[:-1], following[:-1], following[1:], rings[1:]], axis=-1)
    return [tuple(int(v) for v in quad) for quad in quads.reshape(-1, 4)]


def _zip(loop: IntArray) -> list[tuple[int, ...]]:
    """Return the faces that close a loop, its upper half to its lower half."""
    half, count = len(loop) // 2, len(loop)
    faces = []
    for i in range(half):
        corners = dict.fromkeys(int(loop[k % count]) for k in (i, i + 1, count - i - 1, count - i))
        faces.append(tuple(corners))
    return faces


def _relax(
    points: FloatArray, faces: list[tuple[int, ...]], mirror: IntArray, pinned: NDArray[np.bool_]
) -> FloatArray:
    """Spread the free vertices over the skin."""
    edges = np.array([(f[k - 1], f[k]) for f in faces for k in range(len(f))])
    edges = np.unique(np.sort(edges, axis=1), axis=0)
    a, b = np.concatenate([edges, edges[:, ::-1]]).T
    degree = np.bincount(a, minlength=len(points))[:, None]
    free = ~pinned
    for _ in range(24):
        total = np.stack([np.bincount(a, points[b, k], len(points)) for k in range(3)], axis=1)
        moved = points + 0.5 * (total / degree - points)
        points = points.copy()
        points[free] = project(moved[free], rounds=1)
        points = (points + points[mirror] * (-1, 1, 1)) / 2
    points[free] = project(points[free], rounds=3)
    return points


def build() -> HeadMesh:
    """Build the neutral head."""
    origins, directions = _rays()
    rows, columns = origins.shape[:2]
    left = columns // 2
    grid = np.full((rows, columns), -1)
    keep = np.ones((rows, columns), dtype=bool)
    c0, c1 = (c + left for c in EYE_COLUMNS)
    keep[EYE_ROWS[0] + 1 : EYE_ROWS[1], c0 + 1 : c1] = False
    keep[EYE_ROWS[0] + 1 : EYE_ROWS[1], columns - c1 + 1 : columns - c0] = False
    m0, m1 = (c + left for c in MOUTH_COLUMNS)
    keep[MOUTH_ROWS[0] + 1 : MOUTH_ROWS[1], m0 + 1 : m1] = False
    grid[keep] = np.arange(keep.sum())
    points = [march(origins[keep], directions[keep])]
    count = int(keep.sum())

    faces: list[tuple[int, ...]] = []
    for r in range(rows - 1):
        for c in range(columns):
            corners = [(r, c), (r + 1, c), (r + 1, (c + 1) % columns), (r, (c + 1) % columns)]
            quad = [int(grid[corner]) for corner in corners]
            hole = any(
                top <= r < bottom and first <= c < last
                for (top, bottom), (first, last) in (
                    (EYE_ROWS, (c0, c1)),
                    (EYE_ROWS, (columns - c1, columns - c0)),
                    (MOUTH_ROWS, (m0, m1)),
                )
            )
            if not hole:
                faces.append(tuple(quad))
    pole = count
    points.append(march(np.array([[0, 0.04, -0.016]]), np.array([[0.0, 1.0, 0.0]])))
    count += 1
    faces += [(pole, int(grid[0, c]), int(grid[0, (c + 1) % columns])) for c in range(columns)]
    mirror = np.arange(count)
    mirror[grid[keep]] = grid[:, -np.arange(columns) % columns][keep]

    def insert(border: IntArray, front: list[FloatArray], behind: list[FloatArray], total: int):
        nonlocal count
        outer = np.concatenate(points)[border]
        between = np.linspace(0, 1, total - len(front) + 2)[1:-1]
        blend = [front[-1] + s * (outer - front[-1]) for s in between]
        new = front + blend + behind[::-1]
        ids = count + np.arange(len(new) * len(border)).reshape(len(new), -1)
        points.extend(new)
        count += ids.size
        ordered = np.concatenate([ids[:total], border[None]])
        back = ids[total:]
        return np.concatenate([back, ordered])  # innermost ring first

    border = np.array([grid[r, c + left] for r, c in _border(EYE_ROWS, EYE_COLUMNS)])
    front, behind = _eye_rings(len(border))
    eye_left = insert(border, front, behind, EYE_RINGS)
    flip = np.array([-1, 1, 1])
    eye_right = insert(
        mirror[border], [p * flip for p in front], [p * flip for p in behind], EYE_RINGS
    )
    mouth_border = np.array([grid[r, c + left] for r, c in _border(MOUTH_ROWS, MOUTH_COLUMNS)])
    front, behind = _mouth_rings(len(mouth_border))
    mouth = insert(mouth_border, front, behind, MOUTH_RINGS)

    full = np.arange(count)
    full[: len(mirror)] = mirror
    full[eye_left], full[eye_right] = eye_right, eye_left
    loop = mouth.shape[1]
    full[mouth] = mouth[:, (loop // 2 - np.arange(loop)) % loop]

    eyes_start = len(faces)
    faces += _strips(eye_left)
    mouth_start = len(faces)
    faces += [f[::-1] for f in _strips(eye_right)]
    rim = POCKET_RINGS * eye_left.shape[1] + np.arange(3, eye_left.shape[1] // 2)
    upper_rims = np.concatenate([eyes_start + rim, mouth_start + rim])
    mouth_start = len(faces)
    faces += _strips(mouth)
    lips = np.zeros(len(faces) + loop // 2, dtype=bool)
    inner = lips.copy()
    red = mouth_start + loop * (SOCK_RINGS - 1)
    inner[mouth_start:red] = True
    lips[red : red + loop * LIP_RINGS] = True
    inner[len(faces) :] = True
    lashes = np.zeros_like(lips)
    lashes[upper_rims] = True
    faces += _zip(mouth[0])

    pinned = np.zeros(count, dtype=bool)
    pinned[grid[-1]] = True
    pinned[mouth[: SOCK_RINGS + LIP_RINGS]] = True
    for eye in (eye_left, eye_right):
        pinned[eye[: POCKET_RINGS + 4]] = True
    all_points = np.concatenate(points)
    all_points = (all_points + all_points[full] * flip) / 2
    relaxed = _relax(all_points, faces, full, pinned)
    relaxed[full == np.arange(count), 0] = 0
    uvs = np.column_stack([np.arctan2(relaxed[:, 0], relaxed[:, 2] + 0.01), relaxed[:, 1]])
    return HeadMesh(relaxed, faces, uvs, full, (eye_left, eye_right), mouth, lips, inner, lashes)
