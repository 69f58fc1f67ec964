"""A rasteriser for footage: a z-buffer with perspective, smooth shading and painted dots.

Every pixel is the mean of `samples` x `samples` points, so that the edge of a dot is that of a
lens. Compiled by numba: 1280 x 960 with nine points a pixel takes about a quarter of a second.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

__all__ = ["Camera", "Paint", "render"]

AMBIENT = 0.32
LIGHTS = np.array([[-0.45, 0.55, 0.75], [0.85, 0.05, 0.55]])
POWERS = np.array([0.62, 0.20])
PAINT_GLOSS = 0.25


@dataclass(frozen=True)
class Camera:
    """A pinhole at the origin of camera space that looks along -Z; focal length in pixels."""

    focal: float
    size: tuple[int, int]

    def project(self, points: np.ndarray) -> np.ndarray:
        """Return pixels (..., 2), y down, pixel centres at halves."""
        depth = -points[..., 2]
        x = self.focal * points[..., 0] / depth + self.size[0] / 2
        y = -self.focal * points[..., 1] / depth + self.size[1] / 2
        return np.stack([x, y], axis=-1)


@dataclass(frozen=True)
class Paint:
    """Dots on a mesh: the dot of each triangle (-1 = none), their centres and radius at rest."""

    rest: np.ndarray
    of_triangle: np.ndarray
    centres: np.ndarray
    radius: float
    colour: tuple[float, float, float]


@njit(cache=True)
def _raster(screen, depth, triangles, paint, rest, centres, radius2, size, hidden_z):
    width, height = size
    nearest = np.full((height, width), -1, np.int32)
    zbuffer = np.full((height, width), 0.0, np.float32)  # 1 / depth
    shares = np.zeros((height, width, 2), np.float32)
    whole = np.zeros(len(centres))
    sums = np.zeros((len(centres), 2))
    for t in range(len(triangles)):
        ia, ib, ic = triangles[t]
        ax, ay = screen[ia]
        bx, by = screen[ib]
        cx, cy = screen[ic]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area >= -1e-9:  # y is down: front faces turn clockwise
            continue
        left = max(0, int(np.ceil(min(ax, bx, cx) - 0.5)))
        right = min(width - 1, int(np.floor(max(ax, bx, cx) - 0.5)))
        top = max(0, int(np.ceil(min(ay, by, cy) - 0.5)))
        bottom = min(height - 1, int(np.floor(max(ay, by, cy) - 0.5)))
        wa, wb, wc = 1.0 / depth[ia], 1.0 / depth[ib], 1.0 / depth[ic]
        dot = paint[t]
        for py in range(top, bottom + 1):
            y = py + 0.5
            for px in range(left, right + 1):
                x = px + 0.5
                u = ((bx - x) * (cy - y) - (by - y) * (cx - x)) / area
                v = ((cx - x) * (ay - y) - (cy - y) * (ax - x)) / area
                w = 1.0 - u - v
                if u < -1e-9 or v < -1e-9 or w < -1e-9:
                    continue
                inverse = u * wa + v * wb + w * wc
                pu, pv = u * wa / inverse, v * wb / inverse
                if dot >= 0:
                    d = 0.0
                    for k in range(3):
                        r = pu * rest[ia, k] + pv * rest[ib, k] + (1 - pu - pv) * rest[ic, k]
                        d += (r - centres[dot, k]) ** 2
                    if d < radius2:
                        whole[dot] += 1.0
                        sums[dot, 0] += x
                        sums[dot, 1] += y
                if inverse > zbuffer[py, px] and inverse > hidden_z[py, px]:
                    zbuffer[py, px] = inverse
                    nearest[py, px] = t
                    shares[py, px, 0] = pu
                    shares[py, px, 1] = pv
    return nearest, shares, whole, sums


@njit(cache=True)
def _shade(
    nearest,
    shares,
    triangles,
    normals,
    albedo,
    paint,
    rest,
    centres,
    radius2,
    colour,
    samples,
    image,
):
    height, width = nearest.shape
    seen = np.zeros(len(centres))
    lights, powers = LIGHTS, POWERS
    part = 1.0 / (samples * samples)
    for py in range(height):
        for px in range(width):
            t = nearest[py, px]
            if t < 0:
                continue
            ia, ib, ic = triangles[t]
            u, v = shares[py, px, 0], shares[py, px, 1]
            w = 1.0 - u - v
            n0 = u * normals[ia, 0] + v * normals[ib, 0] + w * normals[ic, 0]
            n1 = u * normals[ia, 1] + v * normals[ib, 1] + w * normals[ic, 1]
            n2 = u * normals[ia, 2] + v * normals[ib, 2] + w * normals[ic, 2]
            length = np.sqrt(n0 * n0 + n1 * n1 + n2 * n2) + 1e-12
            light = AMBIENT
            shine = 0.0
            for k in range(len(powers)):
                norm = np.sqrt((lights[k] ** 2).sum())
                c = (n0 * lights[k, 0] + n1 * lights[k, 1] + n2 * lights[k, 2]) / norm / length
                light += powers[k] * max(0.0, (c + 0.25) / 1.25)
                half = (
                    lights[k, 0] * n0 + lights[k, 1] * n1 + (lights[k, 2] / norm + 1) * n2
                ) / length
                half /= np.sqrt(2 + 2 * lights[k, 2] / norm)
                shine += powers[k] * max(0.0, half) ** 40
            painted = False
            dot = paint[t]
            if dot >= 0:
                d = 0.0
                for k in range(3):
                    r = u * rest[ia, k] + v * rest[ib, k] + w * rest[ic, k]
                    d += (r - centres[dot, k]) ** 2
                painted = d < radius2
                if painted:
                    seen[dot] += 1.0
            for k in range(3):
                base = u * albedo[ia, k] + v * albedo[ib, k] + w * albedo[ic, k]
                value = base * light + 0.05 * shine
                if painted:
                    value = colour[k] * light + PAINT_GLOSS * 0.2 * shine
                image[py // samples, px // samples, k] += part * value
    return seen


@njit(cache=True)
def _covered(nearest, samples):
    height, width = nearest.shape
    share = np.zeros((height // samples, width // samples))
    for py in range(height):
        for px in range(width):
            if nearest[py, px] >= 0:
                share[py // samples, px // samples] += 1.0 / (samples * samples)
    return share


def render(points, triangles, normals, albedo, paint, camera, backdrop, samples=3, occluder=None):
    """Render one frame: linear image (H, W, 3), truth of the dots.

    Parameters
    ----------
    points, normals : (V, 3), in camera space
    triangles : (T, 3)
    albedo : (V, 3), linear
    paint : Paint
    camera : Camera
    backdrop : (H, W, 3), linear
    samples : int
    occluder : (H, W, 4) or None
        Linear colour and cover of something in front of everything.

    Returns
    -------
    image : (H, W, 3)
    shares : (M,)
        How much of each dot is visible, of what faces the camera; 0 if nothing faces it.
    centroids : (M, 2) [px]
        Centre of what faces the camera.
    """
    width, height = camera.size
    fine = Camera(camera.focal * samples, (width * samples, height * samples))
    screen = fine.project(points)
    wall = np.zeros((height, width), np.float32)
    if occluder is not None:
        wall = np.where(occluder[..., 3] > 0.5, 1e9, 0.0).astype(np.float32)
    wall = np.repeat(np.repeat(wall, samples, 0), samples, 1)
    nearest, shares, whole, sums = _raster(
        screen, -points[:, 2], triangles, paint.of_triangle, paint.rest, paint.centres,
        paint.radius**2, fine.size, wall,
    )  # fmt: skip
    image = np.zeros((height, width, 3))
    seen = _shade(
        nearest, shares, triangles, normals, albedo, paint.of_triangle, paint.rest, paint.centres,
        paint.radius**2, np.array(paint.colour), samples, image,
    )  # fmt: skip
    image += backdrop * (1.0 - _covered(nearest, samples))[..., None]
    if occluder is not None:
        cover = occluder[..., 3:]
        image = image * (1 - cover) + occluder[..., :3] * cover
    return image, seen / np.maximum(whole, 1), sums / np.maximum(whole, 1)[:, None] / samples
