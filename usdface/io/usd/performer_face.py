"""A performer's face as attributes of a `UsdFaceRetarget` prim (`docs/architecture.md`)."""

import numpy as np
from pxr import Sdf, Usd, Vt

from usdface.arrays import FloatArray
from usdface.errors import InputError
from usdface.io.usd.attributes import author, value_or
from usdface.schemas import tokens
from usdface.setup.performer_face import PerformerFace

__all__ = ["author_performer_face", "read_performer_face"]

_NAMES = Sdf.ValueTypeNames


def author_performer_face(prim: Usd.Prim, face: PerformerFace) -> None:
    """Write a performer's face, in metres."""
    author(prim, tokens.CALIBRATION_MARKERS, _NAMES.TokenArray, Vt.TokenArray(face.markers))
    author(prim, tokens.CALIBRATION_POINTS, _NAMES.IntArray, Vt.IntArray(face.vertices.tolist()))
    author(prim, tokens.CALIBRATION_FRAMES, _NAMES.Int, face.frames)
    author(prim, tokens.CALIBRATION_MOVEMENTS, _NAMES.TokenArray, Vt.TokenArray(face.shapes))
    for name, values in (
        (tokens.CALIBRATION_SHIFTS, face.shifts),
        (tokens.CALIBRATION_REST, face.rest),
        (tokens.CALIBRATION_DISPLACEMENTS, face.displacements.reshape(-1, 3)),
    ):
        author(prim, name, _NAMES.Double3Array, Vt.Vec3dArray.FromNumpy(np.array(values)))


def read_performer_face(prim: Usd.Prim) -> PerformerFace | None:
    """Read a performer's face; None where its markers are not named.

    Raises
    ------
    InputError
        If the arrays do not belong together.
    """

    def value(name: str) -> object:
        return value_or(prim, name, None)

    def names(name: str) -> tuple[str, ...]:
        return tuple(str(entry) for entry in np.atleast_1d(np.array(value(name) or (), object)))

    def vectors(name: str) -> FloatArray:
        return np.array(value(name) or (), dtype=np.float64).reshape(-1, 3)

    markers, shapes = names(tokens.CALIBRATION_MARKERS), names(tokens.CALIBRATION_MOVEMENTS)
    if not markers:
        return None
    moved = vectors(tokens.CALIBRATION_DISPLACEMENTS)
    if len(moved) != len(shapes) * len(markers):
        raise InputError(
            f"{tokens.CALIBRATION_DISPLACEMENTS} has {len(moved)} vectors; expected "
            f"{len(shapes) * len(markers)}, of {len(shapes)} shapes at {len(markers)} markers",
            "SCHEMA_BROKEN",
        )
    frames = value(tokens.CALIBRATION_FRAMES)
    return PerformerFace(
        markers,
        np.array(value(tokens.CALIBRATION_POINTS) or (), dtype=np.int64),
        vectors(tokens.CALIBRATION_SHIFTS),
        vectors(tokens.CALIBRATION_REST),
        frames if isinstance(frames, int) else 0,
        shapes,
        moved.reshape(len(shapes), len(markers), 3),
    )
