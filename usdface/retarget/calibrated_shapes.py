"""The character's blend shapes at the size of a calibrated performer, relative to neutral."""

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from usdface.arrays import FloatArray
from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.options import PERFORMER_GAIN_RANGE
from usdface.retarget.face_fit import FaceFit
from usdface.retarget.rbf import SpaceMap
from usdface.setup.calibration import Calibration
from usdface.setup.retarget_setup import RetargetSetup

__all__ = ["as_large", "as_performed", "enlarged", "performed"]


def performed(
    model: BlendShapeEvaluator,
    names: tuple[str, ...],
    calibration: Calibration,
    rested: Collection[str] = (),
) -> tuple[BlendShapeEvaluator, FloatArray]:
    """Return the performer's shapes, and the displacement of the markers in their neutral.

    A combination shape has no gain of its own.

    Parameters
    ----------
    model : BlendShapeEvaluator
        Of the character: S shapes, N marker coordinates.
    names : tuple of str, length S
    calibration : Calibration
    rested : collection of str
        Shapes whose weights at rest were subtracted from the markers' neutral already: their
        offsets, which describe the same, do not count.

    Returns
    -------
    BlendShapeEvaluator
    (N,) float64 [m]
    """
    gains, offsets = calibration.of(names)
    free = np.isin(np.arange(len(names)), model.free)
    measured = np.array([name in rested for name in names], dtype=bool)
    gains, offsets = np.where(free, gains, 1.0), np.where(free & ~measured, offsets, 0.0)
    paths = tuple(
        replace(p, displacements=gains[p.shape] * p.displacements) for p in model.inbetweens
    )
    scaled = gains[:, None] * model.offsets
    # Offsets are shares of the whole shapes, as they are found: no weights on a path.
    return replace(model, offsets=scaled, inbetweens=paths), offsets @ model.offsets


def as_performed(
    fit: FaceFit, shape_names: tuple[str, ...], setup: RetargetSetup
) -> tuple[BlendShapeEvaluator, SpaceMap]:
    """Return the shapes of a fit at the size of a calibrated performer, and the map to them."""
    if setup.calibration is None:
        return fit.evaluator, fit.space
    # The rig's own neutral is at rest, the performer's need not be.
    rested = shape_names if setup.neutral is None else tuple(setup.neutral_weights)
    model, start = performed(fit.evaluator, shape_names, setup.calibration, rested)
    return model, replace(fit.space, start=start.reshape(fit.points.shape))


def as_large(
    model: BlendShapeEvaluator, shape_names: tuple[str, ...], setup: RetargetSetup
) -> BlendShapeEvaluator:
    """Return displacements by the shapes at the size of a calibrated performer, if there is one."""
    if setup.calibration is None:
        return model
    return performed(model, shape_names, setup.calibration)[0]


def enlarged(
    calibration: Calibration | None, names: tuple[str, ...], factors: FloatArray
) -> Calibration:
    """Return a calibration whose gains are larger by `factors` (S,), of shapes `names`."""
    own, offsets = np.ones(len(names)), np.zeros(len(names))
    if calibration is not None:
        own, offsets = calibration.of(names)
    larger = np.clip(factors * own, *PERFORMER_GAIN_RANGE)
    return Calibration(names, larger, offsets, calibration.face if calibration else None)
