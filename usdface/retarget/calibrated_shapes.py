"""The character's shapes as a calibrated performer makes them: larger or smaller, from rest."""

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from usdface.arrays import FloatArray
from usdface.blend_shape_evaluator import BlendShapeEvaluator
from usdface.retarget_setup import Calibration

__all__ = ["performed"]


def performed(
    model: BlendShapeEvaluator,
    names: tuple[str, ...],
    calibration: Calibration,
    rested: Collection[str] = (),
) -> tuple[BlendShapeEvaluator, FloatArray]:
    """Return the performer's shapes, and what their neutral adds to the markers.

    A combination shape has no gain of its own.

    Parameters
    ----------
    model : BlendShapeEvaluator
        Of the character: S shapes, N marker coordinates.
    names : tuple of str, length S
    calibration : Calibration
    rested : collection of str
        Shapes whose weights at rest were taken off the markers' neutral already: their offsets,
        which describe the same, do not count.

    Returns
    -------
    BlendShapeEvaluator
    (N,) float64 [m]
    """
    gains, offsets = calibration.of(names)
    free = np.isin(np.arange(len(names)), model.free)
    told = np.array([name in rested for name in names], dtype=bool)
    gains, offsets = np.where(free, gains, 1.0), np.where(free & ~told, offsets, 0.0)
    paths = tuple(
        replace(p, displacements=gains[p.shape] * p.displacements) for p in model.inbetweens
    )
    scaled = gains[:, None] * model.offsets
    # Offsets are shares of the whole shapes, as they are found: no weights on a path.
    return replace(model, offsets=scaled, inbetweens=paths), offsets @ model.offsets
