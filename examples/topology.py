"""The head's quads: a grid around the head with loops around the eyes and the mouth."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from examples.rings import LIP_RINGS, POCKET_RINGS, SOCK_RINGS, eye_rings, mouth_rings
from examples.sculpt import march, project
from usdface.arrays import FloatArray, IntArray

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
FLIP = np.array([-1.0, 1.0, 1.0])
EYE_ROWS, EYE_COLUMNS = (9, 15), (3, 11)
MOUTH_ROWS, MOUTH_COLUMNS = (20, 26), (-6, 6)
EYE_RINGS, MOUTH_RINGS = 8, 8  # rings between the grid and the rim, the rim included


@dataclass(frozen=True, eq=False)
class HeadMesh:
    """The neutral head.

    Attributes
    ----------
    points : (V, 3) [m]
    faces : list of tuple of int
    mirror : (V,)
        The vertex on the other side.
    eyes : two arrays (rings, loop)
        Vertices of the left (+X) and right eye, ring 0 = rim of the lids, outwards; negative
        rings (counted from the end) lie behind the rim. Loop 0 = inner corner, then the upper
        lid, the outer corner at half, then the lower lid.
    mouth : (rings, loop)
        Same for the mouth: loop 0 = right corner, upper lip, left corner, lower lip.
    lips : (N,)
        Faces of the red of the lips.
    inner : (N,)
        Faces inside the mouth.
    lashes : (N,)
        Faces of the rim of the upper lids.
    """

    points: FloatArray
    faces: list[tuple[int, ...]]
    mirror: IntArray
    eyes: tuple[IntArray, IntArray]
    mouth: IntArray
    lips: IntArray
    inner: IntArray
    lashes: IntArray


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
        points = (points + points[mirror] * FLIP) / 2
    points[free] = project(points[free], rounds=3)
    return points


class _Builder:
    """Vertices and faces as they are put together."""

    def __init__(self) -> None:
        self.points: list[FloatArray] = []
        self.faces: list[tuple[int, ...]] = []
        self.count = 0

    def add(self, points: FloatArray) -> IntArray:
        """Add points (N, 3); return their indices."""
        self.points.append(points)
        self.count += len(points)
        return np.arange(self.count - len(points), self.count)

    def loops(
        self, border: IntArray, front: list[FloatArray], behind: list[FloatArray], total: int
    ) -> IntArray:
        """Fill the hole inside `border` with `total` rings and those behind: (rings, L)."""
        outer = np.concatenate(self.points)[border]
        between = np.linspace(0, 1, total - len(front) + 2)[1:-1]
        blend = [front[-1] + s * (outer - front[-1]) for s in between]
        rings = [self.add(ring) for ring in (*behind[::-1], *front, *blend)]
        return np.stack([*rings, border])

    def quads(self, faces: list[tuple[int, ...]]) -> NDArray[np.int64]:
        """Add faces; return their indices."""
        self.faces += faces
        return np.arange(len(self.faces) - len(faces), len(self.faces))


def _holes(columns: int) -> NDArray[np.bool_]:
    """Return the cells (rows - 1, columns) of the grid that eyes and mouth take."""
    left = columns // 2
    holes = np.zeros((len(ROWS) - 1, columns), dtype=bool)
    first, last = (c + left for c in EYE_COLUMNS)
    holes[slice(*EYE_ROWS), first:last] = True
    holes[slice(*EYE_ROWS), columns - last : columns - first] = True
    holes[slice(*MOUTH_ROWS), MOUTH_COLUMNS[0] + left : MOUTH_COLUMNS[1] + left] = True
    return holes


def _grid(builder: _Builder) -> tuple[IntArray, IntArray]:
    """Add the grid with its holes, and the crown; return its vertices and their twins."""
    origins, directions = _rays()
    rows, columns = origins.shape[:2]
    solid = ~_holes(columns)
    around = solid | np.roll(solid, 1, axis=1)
    keep = np.ones((rows, columns), dtype=bool)
    keep[1:-1] = around[1:] | around[:-1]
    grid = np.full((rows, columns), -1)
    grid[keep] = builder.add(march(origins[keep], directions[keep]))
    following = np.roll(grid, -1, axis=1)
    quads = np.stack([grid[:-1], grid[1:], following[1:], following[:-1]], axis=-1)[solid]
    builder.quads([tuple(int(v) for v in quad) for quad in quads])
    crown = builder.add(march(np.array([[0, 0.04, -0.016]]), np.array([[0.0, 1.0, 0.0]])))[0]
    fan = zip(grid[0], following[0], strict=True)
    builder.quads([(int(crown), int(a), int(b)) for a, b in fan])
    mirror = np.arange(builder.count)
    mirror[grid[keep]] = grid[:, -np.arange(columns) % columns][keep]
    return grid, mirror


def build() -> HeadMesh:
    """Build the neutral head."""
    builder = _Builder()
    grid, mirror = _grid(builder)
    left = grid.shape[1] // 2

    def around(rows: tuple[int, int], columns: tuple[int, int]) -> IntArray:
        return np.array([grid[r, c + left] for r, c in _border(rows, columns)])

    border = around(EYE_ROWS, EYE_COLUMNS)
    front, behind = eye_rings(len(border))
    eye_left = builder.loops(border, front, behind, EYE_RINGS)
    front, behind = [p * FLIP for p in front], [p * FLIP for p in behind]
    eye_right = builder.loops(mirror[border], front, behind, EYE_RINGS)
    border = around(MOUTH_ROWS, MOUTH_COLUMNS)
    mouth = builder.loops(border, *mouth_rings(len(border)), MOUTH_RINGS)

    loop = mouth.shape[1]
    mirror = np.concatenate([mirror, np.arange(len(mirror), builder.count)])
    mirror[eye_left], mirror[eye_right] = eye_right, eye_left
    mirror[mouth] = mouth[:, (loop // 2 - np.arange(loop)) % loop]

    lids = (builder.quads(_strips(eye_left)), builder.quads([f[::-1] for f in _strips(eye_right)]))
    lips = builder.quads(_strips(mouth)).reshape(-1, loop)
    throat = builder.quads(_zip(mouth[0]))
    upper = slice(3, eye_left.shape[1] // 2)  # without the inner corner, which has no lashes
    lashes = np.concatenate([f.reshape(-1, eye_left.shape[1])[POCKET_RINGS, upper] for f in lids])

    pinned = np.zeros(builder.count, dtype=bool)
    pinned[grid[-1]] = True
    pinned[mouth[: SOCK_RINGS + LIP_RINGS]] = True
    for eye in (eye_left, eye_right):
        pinned[eye[: POCKET_RINGS + 4]] = True
    points = np.concatenate(builder.points)
    points = _relax((points + points[mirror] * FLIP) / 2, builder.faces, mirror, pinned)
    points[mirror == np.arange(len(points)), 0] = 0
    red = lips[SOCK_RINGS - 1 : SOCK_RINGS - 1 + LIP_RINGS].ravel()
    inner = np.concatenate([lips[: SOCK_RINGS - 1].ravel(), throat])
    return HeadMesh(points, builder.faces, mirror, (eye_left, eye_right), mouth, red, inner, lashes)
