"""Gains of movements that exceed the character's, estimated from the take itself.

A blend shape ends at weight 1. Where the performer goes further, the peak is cut off, and other
shapes are pulled in to make up for it. The markers determine the product of the movement's gain and
a weight of at most 1, so that a peak beyond 1 is a lower bound of the gain.
"""

from dataclasses import replace

import numpy as np

from usdface.arrays import FloatArray
from usdface.findings import Finding, finding
from usdface.numerics.ramps import smooth_step
from usdface.options import PERFORMER_GAIN_RANGE
from usdface.retarget.calibrated_shapes import as_performed, enlarged
from usdface.retarget.face_fit import FaceFit
from usdface.retarget.gain_posterior import gain_posterior
from usdface.retarget.motion_model import MotionModel
from usdface.retarget.pose_and_weights import PoseAndWeights
from usdface.retarget.solver.solve import FEWEST_FRAMES
from usdface.retarget.wide_bounds import held_peaks, weights_in_wide_bounds
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake

__all__ = ["take_gains", "with_found_gains"]

# Standard deviations by which a peak must exceed 1 to count as beyond it: from not at all to
# wholly. On performers 1 to 4 of python -m benchmarks.performers the skin is off by 0.497 mm where
# strengths differ and by 0.211 mm where they do not; by 2 and 4 0.517, 0.211; without gains 0.560,
# 0.212.
_BEYOND = (1.0, 3.0)
# Gains closer to 1 have no visible effect, and cost a solve.
_LEAST = 0.01
# Least deviation: the posterior's grid has steps of 0.005.
_FINEST = 0.005


def take_gains(peaks: FloatArray, deviations: FloatArray) -> FloatArray:
    """Return the gain of each movement relative to the character's: (S,), 1 or more.

    Parameters
    ----------
    peaks : (S,) float64
        The peak of each weight without an upper bound.
    deviations : (S,) float64
        Their standard deviation, by noise and misfit.

    Returns
    -------
    (S,) float64
        Exactly 1 where the peak may as well be 1.
    """
    deviations = np.maximum(deviations, _FINEST)
    most, _ = gain_posterior(peaks, deviations, 0.0)
    low, high = _BEYOND
    sure = smooth_step(((peaks - 1.0) / deviations - low) / (high - low))
    gains = (1.0 + sure * (most - 1.0)).clip(1.0, PERFORMER_GAIN_RANGE[1])
    return np.where(gains < 1.0 + _LEAST, 1.0, gains)


def with_found_gains(
    setup: RetargetSetup,
    fit: FaceFit,
    solved: PoseAndWeights,
    shape_names: tuple[str, ...],
    take: MarkerTake,
    errors: FloatArray | None,
) -> tuple[RetargetSetup, list[Finding]]:
    """Return the setup with the gains of movements that exceed the character's; itself if none do.

    Parameters
    ----------
    setup : RetargetSetup
    fit : FaceFit
    solved : PoseAndWeights
        The take solved without them.
    shape_names : tuple of str, length S
    take : MarkerTake
    errors : (M,) float64 [1], optional
        Of the markers (`usdface.retarget.marker_errors`); equal, if left out.
    """
    model, _ = as_performed(fit, shape_names, setup)
    wanted = setup.solve.gains == "found" and setup.map.form != "paper"
    # Weights beyond 1 extrapolate linearly, which inbetweens and combinations do not.
    if not (wanted and model.linear and take.dimension == 3 and len(take.times) >= FEWEST_FRAMES):
        return setup, []
    predicted = model.displacements(solved.weights).reshape(solved.displaced.shape)
    weights, deviations = weights_in_wide_bounds(
        np.where(np.isnan(solved.displaced), predicted, solved.displaced),
        MotionModel(fit.points, model, 3, setup.head == "solve"),
        take.times,
        solved.regularisation,
        within=(0.0, PERFORMER_GAIN_RANGE[1]),
        errors=errors,
    )
    gains = take_gains(held_peaks(weights, take.times), deviations)
    beyond = np.flatnonzero(gains > 1.0)
    if not len(beyond):
        return setup, []
    names = tuple(shape_names[shape] for shape in model.free)
    message = (
        "movements exceed the character's, {shape} by a gain of {gain:.2f}; the gains hold in the "
        "whole take: {shapes}"
    )
    most = int(gains.argmax())
    shapes = [names[shape] for shape in beyond]
    found = finding("GAIN_FOUND", take.source, message, names[most], gains[most], shapes)
    return replace(setup, calibration=enlarged(setup.calibration, names, gains)), [found]
