"""The skin that markers are looked for on, thinned out and measured in its own size."""

from dataclasses import dataclass

import numpy as np

from usdface.binding.skin import Skin
from usdface.takes import FloatArray, IntArray

__all__ = ["Domain", "domain_of", "turning_motions"]

# A performer's strongest movement may be so much stronger than the rig's.
_GAIN = 1.5


@dataclass(frozen=True, eq=False, slots=True)
class Domain:
    """The vertices that are looked at: all the skin or a thinned part.

    Attributes
    ----------
    places : (N,) int64
        Indices into the skin.
    points : (N, 3) float64 [m]
        From the centre of the moving skin.
    basis : (S, N, 3) float64 [m]
        What the blend shapes do at the largest weight of a strong performer.
    rigid : (6, N, 3) float64
        Small rigid motions of the face.
    size : float [m]
        RMS radius of the moving skin.
    """

    places: IntArray
    points: FloatArray
    basis: FloatArray
    rigid: FloatArray
    size: float


def _thinned(points: FloatArray, cell: float) -> IntArray:
    """Return one point of each cell: indices."""
    _, first = np.unique(np.floor(points / cell), axis=0, return_index=True)
    return np.sort(first)


def domain_of(skin: Skin, cell: float = 0.0, keep: IntArray | None = None) -> Domain:
    """Make a domain of one vertex in each `cell` (a share of the face's size; 0 = all).

    `keep` are indices into the skin that stay in.
    """
    moving = skin.points[skin.moving]
    rough = float(np.sqrt(((moving - moving.mean(axis=0)) ** 2).sum(axis=1).mean()))
    # Evenly, or finely meshed lids and lips would be most of the face.
    even = moving[_thinned(moving, 0.08 * rough)]
    centre = even.mean(axis=0)
    size = float(np.sqrt(((even - centre) ** 2).sum(axis=1).mean()))
    places = np.arange(len(skin.points))
    if cell:
        places = _thinned(skin.points, cell * size)
    if keep is not None:
        places = np.union1d(places, keep)
    points = skin.points[places] - centre
    return Domain(places, points, _GAIN * skin.offsets(places), turning_motions(points), size)


def turning_motions(points: FloatArray) -> FloatArray:
    """Return translations and rotations about the centre: (6, N, 3)."""
    turns = np.cross(np.eye(3)[:, None], points)
    shifts = np.broadcast_to(np.eye(3)[:, None], turns.shape)
    return np.concatenate([shifts, turns])
