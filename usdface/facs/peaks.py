"""Action units at the peaks of a take's emotions: at the markers, and on the solved face."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.facs.movements import POINTS
from usdface.facs.poses import judge_pose, units_expected
from usdface.facs.report import FacsReport, PeakVerdict

__all__ = ["TakePeaks", "judge_peaks"]

# A marker stands for a feature point within this distance [mm of a human head]: about the spacing
# of markers on a face.
_NEAR = 10.0
_MM = 1000.0


@dataclass(frozen=True, eq=False, slots=True)
class TakePeaks:
    """Frames of a processed take that are judged, K of them.

    Attributes
    ----------
    emotions : tuple of str, length K
    frames : (K,) int64
        Frame indices of the take.
    times : (K,) float64 [s]
    neutral : (M, 3) float64 [m]
        The markers on the character's neutral face.
    markers : (K, M, 3) float64 [m]
        The markers mapped to the character.
    residual : (K,) float64 [m]
        Distance of the markers from the solved face (RMS).
    names : tuple of str, length S
        Blend shapes.
    solved, corrected : (K, S) float64
        Their weights.
    """

    emotions: tuple[str, ...]
    frames: IntArray
    times: FloatArray
    neutral: FloatArray
    markers: FloatArray
    residual: FloatArray
    names: tuple[str, ...]
    solved: FloatArray
    corrected: FloatArray


def judge_peaks(report: FacsReport, peaks: TakePeaks) -> tuple[PeakVerdict, ...]:
    """Judge peaks of emotions by the units of their FACS prototypes.

    Emotions without one are left out.
    """
    points, rig = report.points, report.rig
    solved = points.displaced(rig, peaks.names, peaks.solved)
    corrected = points.displaced(rig, peaks.names, peaks.corrected)
    measured = np.zeros_like(solved)
    for point, marker in _markers_at(points.centres(rig), peaks.neutral, points.unit).items():
        moved = (peaks.markers[:, marker] - peaks.neutral[marker]) / points.unit
        measured[:, POINTS.index(point)] = np.nan_to_num(moved)
    result = []
    for k, emotion in enumerate(peaks.emotions):
        units = units_expected(emotion)
        if not units:
            continue
        noise = max(report.noise, _MM * float(np.nan_to_num(peaks.residual[k])))
        large = report.shapes.large
        verdicts = [
            judge_pose(emotion, at[k], units, noise, large) for at in (measured, solved, corrected)
        ]
        frame, time = int(peaks.frames[k]), float(peaks.times[k])
        result.append(PeakVerdict(emotion, frame, time, noise, *verdicts))
    return tuple(result)


def _markers_at(
    centres: Mapping[str, FloatArray], neutral: FloatArray, unit: float
) -> dict[str, int]:
    """Return the marker at each feature point that has one: each is the other's nearest."""
    points = list(centres)
    if not len(neutral):
        return {}
    away = np.linalg.norm(np.array(list(centres.values()))[:, None] - neutral, axis=2)
    nearest = away.argmin(axis=1)
    mutual = away.argmin(axis=0)[nearest] == np.arange(len(points))
    near = away.min(axis=1) < _NEAR * unit
    return {points[i]: int(nearest[i]) for i in np.flatnonzero(mutual & near).tolist()}
