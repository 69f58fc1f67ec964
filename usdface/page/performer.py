"""The performer's markers on a page, placed beside the face."""

from typing import Any

import numpy as np

from usdface.arrays import FloatArray
from usdface.face.bound_face import BoundFace
from usdface.geometry.marker_spread import marker_spread
from usdface.geometry.rigid_fit import similarity_fit
from usdface.numerics.seen_mean import seen_mean
from usdface.page.packed_data import Quantized
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake

__all__ = ["markers_on_face", "performer_data"]

# Markers further from the face [spreads of its markers] are not shown: spikes of a recording.
_ASTRAY = 20.0


def markers_on_face(
    take: MarkerTake, setup: RetargetSetup, face: BoundFace, head: FloatArray
) -> FloatArray:
    """Return the markers of a take in the space and the size of the face: (F, M, 3) [m].

    A similarity brings the bound markers at rest onto their vertices; NaN = occluded.

    Parameters
    ----------
    take : MarkerTake
    setup : RetargetSetup
    face : BoundFace
        Of the setup.
    head : (F, 4, 4) float64
        Head poses to take out of the motion; (0, 4, 4) = none.
    """
    positions = take.positions
    if take.dimension == 2:
        positions = np.concatenate([positions, np.zeros((*positions.shape[:2], 1))], axis=2)
        positions[..., 2][np.isnan(positions[..., 0])] = np.nan
    elif len(head) == len(positions):
        inverse = np.linalg.inv(head)
        positions = positions @ inverse[:, :3, :3] + inverse[:, None, 3, :3]
    first, last = setup.neutral or (0, 0)
    rest = seen_mean(positions[first : last + 1])
    bound = [name for name in face.markers if name in take.names]
    columns = [take.names.index(name) for name in bound]
    seen = ~np.isnan(rest[columns]).any(axis=1)
    source = rest[columns][seen]
    target = face.mesh.points[face.vertices_of(bound)][seen]
    if take.dimension == 2:
        target = target * (1.0, 1.0, 0.0)
    if len(source) < 3:
        return _centred(positions, rest, face)
    linear, offset = similarity_fit(source, target)
    placed = positions @ linear + offset
    away = np.linalg.norm(placed - target.mean(axis=0), axis=2)
    return np.where((away > _ASTRAY * marker_spread(target))[..., None], np.nan, placed)


def _centred(positions: FloatArray, rest: FloatArray, face: BoundFace) -> FloatArray:
    """Return markers at the middle of the face, in its size: too few are bound to fit them to it.

    Those of an image are in pixels, and those of a performer may be far smaller than a character:
    unscaled they would lie outside the picture, or be a speck in it.
    """
    known = rest[~np.isnan(rest).any(axis=1)]
    moved = [shape.indices for shape in face.mesh.shapes if shape.offsets.any()]
    skin = face.mesh.points[np.unique(np.concatenate(moved))] if moved else face.mesh.points
    if not len(known):
        return np.asarray(positions + skin.mean(axis=0))
    spread = marker_spread(known)
    size = marker_spread(skin) / spread if spread > 0 else 1.0
    return np.asarray(size * (positions - known.mean(axis=0)) + skin.mean(axis=0))


def performer_data(
    take: MarkerTake, positions: FloatArray, face: BoundFace | None
) -> dict[str, Any]:
    """Return names and positions (F, M, 3) [m] of markers for a page, and which are bound."""
    bound = set(face.markers) if face else set()
    return {
        "names": list(take.names),
        "bound": [name in bound for name in take.names],
        "positions": Quantized(positions),
    }
