"""Faces of a few markers that move about and rest for a while."""

import numpy as np

__all__ = ["TIMES", "breathing"]

TIMES = np.arange(120) / 30.0


def breathing(hold: slice) -> np.ndarray:
    """A face of ten markers that swings about, but rests while `hold` says so."""
    rng = np.random.default_rng(1)
    rest, swing = 0.05 * rng.normal(size=(10, 3)), 0.01 * rng.normal(size=(10, 3))
    swing[:6] = 0.0
    amount = np.sin(2 * np.pi * TIMES) * 0.7 + 1.3
    amount[hold] = 0.0
    return rest + amount[:, None, None] * swing
