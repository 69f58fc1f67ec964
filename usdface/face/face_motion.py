"""Face motion: how several faces move at the same places, for each action unit.

Every artist's and every person's brow goes up in a direction of its own. `face_motion.json` has the
displacements of four rigs at places all over the face (`usdface.face.face_coordinates`): the ICT
face (USC ICT, MIT), MakeHuman's expression units (targets) and its pose units (joints; both CC0),
and the project's example. Made by `python benchmarks/face_motion.py`; symmetric.
"""

import json
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from types import MappingProxyType

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.face.bound_face import BoundFace
from usdface.face.face_coordinates import coordinates_on

__all__ = ["FaceMotion", "face_motion", "motion_at"]

# The file has thousandths.
_SCALE = 0.001
# A marker moves as the mean of the places around it, weighted by distance; a place at this one, in
# heights from mouth to eyes, weighs half of one at the marker. Nearer to the midline, motion to
# the side falls to 0 there.
_HALF_AWAY = 0.05
# A marker whose nearest place is farther away does not move.
_FARTHEST = 0.35


@dataclass(frozen=True, eq=False, slots=True)
class FaceMotion:
    """Displacements of P places, lengths by the height from mouth to eyes.

    Attributes
    ----------
    places : (P, 2) float64
        Of the left half of the face and the midline: x to the left, y up from the eyes.
    slits : (P, 2) int64
        As in `FaceCoordinates`.
    rigs : mapping of str to mapping of int to (P, 3) float64
        For each rig, of each action unit at full strength: x to the left, y up, z forward.
    """

    places: FloatArray
    slits: IntArray
    rigs: Mapping[str, Mapping[int, FloatArray]]


@cache
def face_motion() -> FaceMotion:
    """Return the table."""
    read = json.loads(files("usdface.face").joinpath("face_motion.json").read_text("utf-8"))
    rigs = {
        name: MappingProxyType({int(u): _SCALE * np.array(m) for u, m in units.items()})
        for name, units in read["rigs"].items()
    }
    return FaceMotion(
        _SCALE * np.array(read["places"]), np.array(read["slits"]), MappingProxyType(rigs)
    )


def motion_at(
    face: BoundFace, rigs: Collection[str] | None = None
) -> dict[str, dict[int, FloatArray]] | None:
    """Return the displacements of a face's markers by each action unit, as on other faces.

    Parameters
    ----------
    face : BoundFace
        With a layout that has lips and lids.
    rigs : collection of str, optional
        Of `FaceMotion.rigs`; all of them by default.

    Returns
    -------
    dict of str to dict of int to (M, 3) float64, or None
        For each rig, of each action unit: displacements [m]. None where
        lips, lids or nose tip are not known.
    """
    on = coordinates_on(face, face.neutral)
    if on is None:
        return None
    table = face_motion()
    side = np.where(on.places[:, 0] < 0.0, -1.0, 1.0)
    at = on.places * np.c_[side, np.ones(len(side))]
    away = np.linalg.norm(at[:, None] - table.places, axis=2)
    away[(on.slits[:, None] * table.slits < 0).any(axis=2)] = np.inf
    shares = 1.0 / (1.0 + (away / _HALF_AWAY) ** 4)
    shares /= np.maximum(shares.sum(axis=1, keepdims=True), 1e-12)
    shares[away.min(axis=1) > _FARTHEST] = 0.0
    # Odd in x: on the midline the rounding of a place is not to decide its side.
    lateral = np.clip(on.places[:, 0] / _HALF_AWAY, -1.0, 1.0)
    mirror = np.c_[lateral, np.ones((len(side), 2))] * on.unit
    return {
        name: {unit: mirror * (shares @ moved) for unit, moved in units.items()}
        for name, units in table.rigs.items()
        if rigs is None or name in rigs
    }
