"""A small take of markers, some of them hidden at times."""

import numpy as np

from usdface.takes import MarkerTake

RNG = np.random.default_rng(3)
NAMES = ("chin", "brow L", "鼻")


def marker_take(dimension: int = 3, **settings: object) -> MarkerTake:
    positions = RNG.normal(size=(12, 3, dimension)) * (0.1 if dimension == 3 else 300)
    positions[0, 1] = positions[3:6, 1] = positions[11, 2] = np.nan
    settings = {"rate": 60.0, "source": "jaw.c3d", **settings}
    return MarkerTake(NAMES, np.arange(12) / 60, positions, **settings)  # type: ignore[arg-type]
