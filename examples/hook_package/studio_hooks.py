"""Hooks of a studio: a function for each point.

A hook gets immutable arrays and returns a new value, or None to leave it as it is.
"""

from dataclasses import replace

import numpy as np

from usdface import MarkerTake, Rig, Shot, WeightsTake
from usdface.clips import Clip

LOOSE = ("temple_right",)  # markers that come off on our stage
REST = 0.01  # weights below it are noise in our rigs
MOST = {"jawOpen": 0.9}  # weights beyond which our rigs break


def without_loose_markers(
    take: MarkerTake | WeightsTake, shot: Shot
) -> MarkerTake | WeightsTake | None:
    """Occlude markers that come off; the solve predicts them from the others."""
    if isinstance(take, WeightsTake):
        return None
    positions = take.positions.copy()  # the take's own array is read-only
    positions[:, [take.names.index(name) for name in LOOSE if name in take.names]] = np.nan
    return replace(take, positions=positions)


def rested(weights: WeightsTake, shot: Shot) -> WeightsTake:
    """Bring the smallest weights to rest."""
    return replace(weights, weights=np.where(weights.weights < REST, 0.0, weights.weights))


def within_the_rig(weights: WeightsTake, shot: Shot) -> WeightsTake:
    """Keep weights within the range of the rig."""
    most = np.array([MOST.get(name, 1.0) for name in weights.names])
    return replace(weights, weights=np.minimum(weights.weights, most))


def named_clips(rig: Rig, clips: tuple[Clip, ...]) -> tuple[Rig, tuple[Clip, ...]]:
    """Name clips after the character, as our game engine wants them."""
    return rig, tuple(replace(clip, name=f"{rig.name}_{clip.name}") for clip in clips)
