"""Small painted worlds: discs on a skin-coloured ground, with known centres, as arrays."""

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.footage.colour_channel import Pixels

__all__ = ["GREEN", "SKIN", "layout", "paint", "performance"]

SKIN = (205, 160, 138)
GREEN = (60, 165, 90)


def layout(columns: int = 5, rows: int = 4, spacing: float = 34.0) -> FloatArray:
    """Return places (M, 2) in a grid that is a little out of line, as dots on a face are."""
    random = np.random.default_rng(2)
    x, y = np.meshgrid(np.arange(columns), np.arange(rows))
    grid = np.stack([x, y], axis=-1).reshape(-1, 2) * spacing + (60.0, 50.0)
    return np.asarray(grid + random.uniform(-0.18, 0.18, grid.shape) * spacing)


def paint(
    centres: FloatArray,
    *,
    radius: float = 5.0,
    colour: tuple[int, int, int] = GREEN,
    size: tuple[int, int] = (280, 220),
    noise: float = 1.0,
    seed: int = 0,
    stretch: tuple[float, float] = (1.0, 1.0),
) -> Pixels:
    """Paint discs with soft edges at centres (M, 2) on skin that is lit from one side.

    `stretch` makes ellipses, by a factor in x and in y.
    """
    width, height = size
    x, y = np.arange(width) + 0.5, np.arange(height) + 0.5
    light = 0.8 + 0.35 * x / width
    image = np.empty((height, width, 3))
    image[:] = np.array(SKIN) * light[None, :, None]
    reach = int(radius * max(stretch) + 3)
    for cx, cy in centres.tolist():
        if np.isnan(cx):
            continue
        at = (
            slice(max(int(cy) - reach, 0), max(int(cy) + reach, 0)),
            slice(max(int(cx) - reach, 0), max(int(cx) + reach, 0)),
        )
        away = np.hypot((x[at[1]] - cx) / stretch[0], (y[at[0], None] - cy) / stretch[1])
        cover = np.clip(radius + 0.5 - away, 0.0, 1.0)[..., None]
        image[at] += (np.array(colour) * light[None, at[1], None] - image[at]) * cover
    random = np.random.default_rng([7, seed])
    image += noise * random.standard_normal(image.shape, dtype=np.float32)
    return np.asarray(np.rint(image).clip(0, 255), dtype=np.uint8)


def performance(
    count: int, hidden: dict[int, tuple[int, int]] | None = None, motion: float = 1.0
) -> tuple[FloatArray, BoolArray]:
    """Return places (F, M, 2) of a head that sways and dots that move, and which are visible.

    `hidden`: dot -> first and last frame in which it is not to be seen.
    """
    home = layout()
    t = np.arange(count) / 30.0
    middle = home.mean(axis=0)
    turn = 0.12 * motion * np.sin(2 * np.pi * 0.8 * t)
    shift = motion * np.stack([18 * np.sin(2 * np.pi * 0.7 * t), 9 * np.sin(5.0 * t)], axis=1)
    cos, sin = np.cos(turn), np.sin(turn)
    turned = np.einsum("abf,mb->fma", np.array([[cos, -sin], [sin, cos]]), home - middle)
    own = np.sin(2 * np.pi * np.outer(t, 0.5 + 0.07 * np.arange(len(home))))
    places = turned + middle + shift[:, None]
    places[..., 1] += 4.0 * motion * own
    seen = np.ones(places.shape[:2], dtype=bool)
    for dot, (first, last) in (hidden or {}).items():
        seen[first : last + 1, dot] = False
    return places, seen
