"""Features: marker motions that are the inputs of a fuzzy system.

The head's own motion must have been removed from the positions. Every feature is the change
of one marker's distance to the nose tip along one axis, from neutral: Zikky et al. 2013,
section 4 ("absolute"); the signed form distinguishes a lowered brow from a raised one.
"""

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from scipy.ndimage import gaussian_filter1d

from usdface.arrays import FloatArray, IntArray
from usdface.errors import InputError
from usdface.expression_system import ExpressionSystem, MarkerFeature
from usdface.geometry.marker_spread import marker_spread
from usdface.takes import frame_step

__all__ = ["MILLIMETRE", "face_unit", "measure", "smooth", "smoothed_blocks"]

MILLIMETRE = 0.001
_AXES = {"x": 0, "y": 1, "z": 2}
# Standard deviations at which the Gaussian ends, as in scipy.
_TRUNCATED = 4.0


def face_unit(system: ExpressionSystem, neutral: FloatArray) -> float:
    """Return the length [m] that the system's features are divided by.

    One millimetre, or the `marker_spread` of the `neutral` markers (M, 3) [m].
    """
    return MILLIMETRE if system.face_unit == "none" else marker_spread(neutral)


def measure(
    positions: FloatArray,
    neutral: FloatArray,
    names: Sequence[str],
    features: Sequence[MarkerFeature],
    roles: Mapping[str, str],
    nose_tip: str,
    unit: float,
) -> FloatArray:
    """Measure the features of a take.

    Parameters
    ----------
    positions : (F, M, 3) float64 [m]
        Head-stabilised markers; NaN = occluded, which gives NaN.
    neutral : (M, 3) float64 [m]
        The same markers on the neutral face.
    names : sequence of str, length M
    features : sequence of MarkerFeature, length I
        "signed": change of p - nose along the axis; "absolute": |change of |p - nose||.
    roles : mapping of str to str
        Role to marker; a role without an entry is the name of a marker.
    nose_tip : str
        Marker that distances are measured to.
    unit : float [m]
        Features are divided by it, see `face_unit`.

    Returns
    -------
    (F, I) float64 [unit]

    Raises
    ------
    InputError
        If there is no such marker.
    """
    index = {name: i for i, name in enumerate(names)}
    if nose_tip not in index:
        raise InputError(
            f"no nose tip: the markers have no {nose_tip!r}; name one of {', '.join(names)}"
        )
    marker = np.array([_marker(index, roles, f) for f in features], dtype=np.intp)
    axis = np.array([_AXES[f.axis] for f in features], dtype=np.intp)
    nose = index[nose_tip]
    offset = positions[:, marker, axis] - positions[:, nose, axis]
    neutral_offset = neutral[marker, axis] - neutral[nose, axis]
    absolute = np.array([f.measure == "absolute" for f in features], dtype=bool)
    change = np.where(
        absolute, np.abs(np.abs(offset) - np.abs(neutral_offset)), offset - neutral_offset
    )
    return np.asarray(change / unit, dtype=np.float64)


def _marker(index: Mapping[str, int], roles: Mapping[str, str], feature: MarkerFeature) -> int:
    name = roles.get(feature.role, feature.role)
    if name not in index:
        raise InputError(
            f"the feature {feature.name!r} is of the role {feature.role!r}, but there is no "
            f"marker {name!r}; give the role one of {', '.join(index)}"
        )
    return index[name]


def smooth(features: FloatArray, times: FloatArray, width: float) -> FloatArray:
    """Smooth features over time: a Gaussian, forwards and backwards alike, so nothing lags.

    Parameters
    ----------
    features : (F, I) float64
        NaN stays NaN and weighs nothing in its neighbours.
    times : (F,) float64 [s]
        Increasing; their median step counts. Frames on either side of a gap in the recording that
        is longer than `width` are smoothed by themselves.
    width : float [s]
        Standard deviation of the Gaussian; 0 changes nothing.
    """
    cuts = _cuts(times, width)
    deviation = _deviation(times, width)
    return np.concatenate([_gaussian(part, deviation) for part in np.split(features, cuts)])


def smoothed_blocks(
    values: Callable[[slice], FloatArray], times: FloatArray, width: float
) -> Callable[[slice], FloatArray]:
    """Return a function that smooths a block of frames by those around it, as `smooth` does.

    Parameters
    ----------
    values : callable
        Returns the values (B, ...) of a block of the take's frames.
    times : (F,) float64 [s]
    width : float [s]
    """
    frames, cuts = _deviation(times, width), _cuts(times, width)
    reach = math.ceil(_TRUNCATED * frames) + 1

    def smoothed(block: slice) -> FloatArray:
        first = max(block.start - reach, 0)
        around = values(slice(first, min(block.stop + reach, len(times))))
        inside = cuts[(cuts > first) & (cuts < first + len(around))] - first
        parts = np.split(around.reshape(len(around), -1), inside)
        flat = np.concatenate([_gaussian(part, frames) for part in parts]).reshape(around.shape)
        return flat[block.start - first : block.stop - first]

    return smoothed


def _deviation(times: FloatArray, width: float) -> float:
    """Return a standard deviation in frames; 0 of a take without two of them."""
    return width / frame_step(times) if width and len(times) > 1 else 0.0


def _cuts(times: FloatArray, width: float) -> IntArray:
    """Return the first frame after each gap in the recording that is longer than `width` [s]."""
    if len(times) < 2:
        return np.zeros(0, dtype=np.int64)
    return np.flatnonzero(np.diff(times) > max(width, 1.5 * frame_step(times))) + 1


def _gaussian(features: FloatArray, frames: float) -> FloatArray:
    if frames == 0.0:
        return features

    def mean(values: FloatArray) -> FloatArray:
        smooth = gaussian_filter1d(values, frames, axis=0, mode="nearest", truncate=_TRUNCATED)
        return np.asarray(smooth)

    known = ~np.isnan(features)
    if known.all():
        return mean(features)
    total, share = mean(np.where(known, features, 0.0)), mean(known.astype(np.float64))
    smoothed = np.full(features.shape, np.nan)
    np.divide(total, share, out=smoothed, where=known)
    return smoothed
