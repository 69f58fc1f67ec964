"""Whether a take shows the person of a performer's file: resting markers, compared as a face.

Reapplied markers are off each by itself, those of another person's face together: the proportions
differ. So the part of a marker's difference counts that it shares with the markers around it, once
the two faces are aligned and the expressions that they show are removed.
"""

import numpy as np

from usdface.arrays import FloatArray
from usdface.geometry.marker_spread import rms_radius
from usdface.geometry.nearest_points import nearest_points
from usdface.geometry.rigid_fit import similarity_fit
from usdface.geometry.rigid_modes import motion_basis

__all__ = ["OTHER_PERSON", "shared_difference"]

# Shared difference from which on the face is another one, as a share of its size: 0.19 mm on ICT's.
# Between one person's rests (AnimFace's two takes: 0, also with a frame of an expression; simulated
# performers: 0.0003, with reapplied markers 4 mm off 0) and other persons (AnimFace and
# simulated performers: 0.0043 and more). Of simulated performers among each other, who differ less
# than people do, it distinguishes 92 % by 68 markers and 42 % by 41. See docs/measurements.md.
OTHER_PERSON = 0.003
# Standard deviations that are subtracted of what differences of each by itself share by chance:
# with 2, of the simulated performers 87 and 19 % are told.
_UNLIKELY = 1.0
# Markers around each one. Set by hand.
_AROUND = 4
# Fewer markers do not tell proportions from places. Set by hand: three times as many.
_FEWEST = 3 * _AROUND
# Deviation of a weight that one of the two rests shows, and of what weights do not explain, as a
# share of the face's size. Set by hand.
_SHOWN, _LEFT = 0.1, 0.005


def shared_difference(before: FloatArray, now: FloatArray, displacements: FloatArray) -> float:
    """Return how much two rests differ as faces do, as a share of the face's size.

    Parameters
    ----------
    before, now : (M, 3) float64
        The resting markers, in any two spaces.
    displacements : (S, M, 3) float64
        Of the blend shapes at `before`.

    Returns
    -------
    float
        Root of the mean product of a marker's difference and the mean one of those around it, less
        what it is by chance; 0 where they share no more, or there are too few markers.
    """
    if len(now) < _FEWEST:
        return 0.0
    size = rms_radius(now)
    linear, offset = similarity_fit(before, now)
    away = (now - before @ linear - offset).ravel() / size
    shown = (displacements @ linear).reshape(len(displacements), now.size).T / size
    centred = now - now.mean(axis=0)
    pose = np.linalg.qr(np.column_stack([motion_basis(now, 3), centred.ravel()]))[0]
    shown = shown - pose @ (pose.T @ shown)
    normal = shown.T @ shown + (_LEFT / _SHOWN) ** 2 * np.eye(shown.shape[1])
    left = (away - shown @ np.linalg.solve(normal, shown.T @ away)).reshape(-1, 3)
    around = left[nearest_points(now, _AROUND)].mean(axis=1)
    square = float((left**2).mean())
    by_chance = square * np.sqrt(2.0 / (left.size * _AROUND))
    shared = float((left * around).mean()) - _UNLIKELY * by_chance
    return float(np.sqrt(max(shared, 0.0)))
