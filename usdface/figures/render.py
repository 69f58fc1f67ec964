"""Pictures of triangle meshes in pure numpy: a z-buffer, smooth shading, ambient occlusion."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from usdface.arrays import FloatArray, IntArray
from usdface.geometry.vertex_normals import triangle_normals
from usdface.geometry.view_rotation import view_rotation

__all__ = ["View", "openness", "render"]

# Direction towards each light [camera space: x right, y up, z to the viewer], colour, wrap.
# A wrapped light reaches a little behind the terminator, which reads as soft skin.
LIGHTS = (
    ((-0.45, 0.55, 0.75), (0.80, 0.76, 0.71), 0.25),
    ((0.85, 0.05, 0.55), (0.26, 0.27, 0.31), 0.60),
    ((0.50, 0.50, -0.75), (0.30, 0.30, 0.34), 0.10),
)
AMBIENT = (0.26, 0.27, 0.30)
AMBIENT_DIRECTIONS = 40
AMBIENT_PIXELS = 128


@dataclass(frozen=True, slots=True)
class View:
    """A camera that looks at `centre`.

    Attributes
    ----------
    yaw, pitch : float [degree]
        Where the camera stands: yaw 0 in front (+Z), positive to +X; pitch positive above.
    centre : (float, float, float) [m]
    height : float [m]
        Height of the picture at the centre's distance.
    size : (int, int)
        Width and height [px].
    background : (float, float, float)
        Linear colour.
    samples : int
        Sub-pixels per pixel and axis.
    """

    yaw: float = 0.0
    pitch: float = 0.0
    centre: tuple[float, float, float] = (0.0, -0.01, 0.0)
    height: float = 0.34
    size: tuple[int, int] = (400, 400)
    background: tuple[float, float, float] = (0.80, 0.83, 0.86)
    samples: int = 2


def _rasterise(
    screen: FloatArray, triangles: IntArray, width: int, height: int
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return per pixel the nearest triangle (-1 = none), its barycentrics (P, 3), the depth.

    `screen` (V, 3): x right and y down in pixels, z larger = nearer.
    """
    corners = screen[triangles]
    a, b, c = (corners[:, k, :2] for k in range(3))
    least, most = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    low = np.clip(np.ceil(least - 0.5), 0, (width, height)).astype(int)
    high = np.clip(np.floor(most - 0.5) + 1, 0, (width, height)).astype(int)
    span = np.maximum(high - low, 0)
    count = span[:, 0] * span[:, 1]
    which = np.repeat(np.arange(len(triangles)), count)
    place = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
    px = low[which, 0] + place % np.maximum(span[which, 0], 1)
    py = low[which, 1] + place // np.maximum(span[which, 0], 1)
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    area = np.where(np.abs(area) < 1e-12, np.inf, area)
    bary = np.empty((len(which), 3))
    for k, (p, q) in enumerate(((b, c), (c, a))):
        edge = q - p
        bary[:, k] = (
            edge[which, 0] * (py + 0.5 - p[which, 1]) - edge[which, 1] * (px + 0.5 - p[which, 0])
        ) / area[which]
    bary[:, 2] = 1 - bary[:, 0] - bary[:, 1]
    inside = (bary >= -1e-9).all(axis=1) & np.isfinite(area[which])
    which, bary, pixel = which[inside], bary[inside], (py * width + px)[inside]
    depth = (bary * corners[which, :, 2]).sum(axis=1)
    order = np.argsort(depth, kind="stable")  # the nearest is written last and stays
    owner = np.full(width * height, -1)
    owner[pixel[order]] = order
    hit = owner >= 0
    nearest = np.full(width * height, -1)
    nearest[hit] = which[owner[hit]]
    shares = np.zeros((width * height, 3))
    shares[hit] = bary[owner[hit]]
    buffer = np.full(width * height, -np.inf)
    buffer[hit] = depth[owner[hit]]
    return nearest, shares, buffer


def openness(points: FloatArray, triangles: IntArray) -> FloatArray:
    """Return the share of the sky that each vertex sees, cosine-weighted: (V,), 0 to 1.

    Parameters
    ----------
    points : (V, 3) float64
    triangles : (T, 3) int64
    """
    normals = triangle_normals(points, triangles)
    index = np.arange(AMBIENT_DIRECTIONS) + 0.5
    polar = np.degrees(np.arcsin(1 - 2 * index / AMBIENT_DIRECTIONS))
    around = np.degrees(index * np.pi * (1 + 5**0.5)) % 360
    centre = (points.min(axis=0) + points.max(axis=0)) / 2
    scale = (AMBIENT_PIXELS / 2 - 2) / np.linalg.norm(points - centre, axis=1).max()
    seen, possible = np.zeros(len(points)), np.full(len(points), 1e-9)
    for yaw, pitch in zip(around, polar, strict=True):
        camera = view_rotation(yaw, pitch)
        local = (points - centre) @ camera.T * scale
        screen = local * (1, -1, 1) + (AMBIENT_PIXELS / 2, AMBIENT_PIXELS / 2, 0)
        buffer = _rasterise(screen, triangles, AMBIENT_PIXELS, AMBIENT_PIXELS)[2]
        x, y = screen[:, :2].astype(int).T
        facing = np.maximum(normals @ camera[2], 0)
        seen += facing * (local[:, 2] > buffer[y * AMBIENT_PIXELS + x] - 2.5)
        possible += facing
    return np.asarray(seen / possible)


def _tone(linear: FloatArray) -> FloatArray:
    """Encode linear colour as sRGB in [0, 1]."""
    x = np.clip(linear, 0, 1)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)


def render(
    points: FloatArray,
    triangles: IntArray,
    colours: FloatArray,
    view: View,
    gloss: FloatArray | None = None,
    sky: FloatArray | None = None,
) -> NDArray[np.uint8]:
    """Render triangles with smooth normals.

    Parameters
    ----------
    points : (V, 3) [m]
    triangles : (T, 3)
        Counter-clockwise seen from outside.
    colours : (T, 3) or (V, 3)
        Linear colour in [0, 1] per triangle or vertex (per triangle where both would fit).
    view : View
    gloss : (T,), optional
        Strength of the highlight in [0, 1].
    sky : (V,), optional
        Openness of the vertices, if it is known.

    Returns
    -------
    (H, W, 3) uint8, sRGB
    """
    width, height = (n * view.samples for n in view.size)
    normals = triangle_normals(points, triangles)
    open_to_sky = openness(points, triangles) if sky is None else sky
    camera = view_rotation(view.yaw, view.pitch)
    local = (points - view.centre) @ camera.T
    distance = 3.0 * view.height  # a portrait lens
    scale = height / view.height * distance / (distance - local[:, 2:])
    screen = np.column_stack(
        [local[:, :2] * scale * (1, -1) + (width / 2, height / 2), local[:, 2]]
    )
    nearest, shares, _ = _rasterise(screen, triangles, width, height)
    hit = nearest >= 0
    face, share = nearest[hit], shares[hit]

    def across(values: FloatArray) -> FloatArray:
        return np.asarray(np.einsum("pk,pkc->pc", share, values[triangles[face]]))

    normal = across(normals @ camera.T)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-9)
    open_sky = across(open_to_sky[:, None])
    albedo = colours[face] if len(colours) == len(triangles) else across(colours)
    shine = np.zeros(len(face)) if gloss is None else gloss[face]
    light = np.array(AMBIENT) * (0.15 + 0.85 * open_sky)
    highlight = np.zeros(len(face))
    for towards, colour, wrap in LIGHTS:
        unit = np.array(towards) / np.linalg.norm(towards)
        diffuse = np.maximum(normal @ unit + wrap, 0) / (1 + wrap)
        light = light + diffuse[:, None] * np.array(colour) * (0.4 + 0.6 * open_sky)
        half = unit + np.array([0, 0, 1.0])
        half /= np.linalg.norm(half)
        sharp = 10 + 700 * shine**3
        highlight += shine * np.maximum(normal @ half, 0) ** sharp * np.mean(colour)
    image = np.tile(np.array(view.background), (width * height, 1))
    image[hit] = albedo * light + highlight[:, None]
    blocks = image.reshape(view.size[1], view.samples, view.size[0], view.samples, 3)
    return np.asarray(np.round(_tone(blocks.mean(axis=(1, 3))) * 255), dtype=np.uint8)
