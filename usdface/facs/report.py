"""A rig judged by action units: its blend shapes, its expression poses, the peaks of its take."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from usdface.arrays import FloatArray
from usdface.face.facing import rig_to_front
from usdface.facs.feature_points import FeaturePoints, find_feature_points
from usdface.facs.judge import ShapeVerdict, ShapeVerdicts, judge_shapes
from usdface.facs.movements import MOVEMENTS
from usdface.facs.poses import PoseVerdict, judge_pose, units_expected
from usdface.facs.shape_claims import Claim
from usdface.findings import Finding, finding
from usdface.options import MARKER_NOISE
from usdface.rigs import Rig
from usdface.setup.expression import Expression

__all__ = ["FacsReport", "PeakVerdict", "facs_findings", "judge_rig"]

_MM = 1000.0


@dataclass(frozen=True, slots=True)
class PeakVerdict:
    """The action units at the peak of an emotion.

    Attributes
    ----------
    emotion : str
    frame : int
        Frame index of the take.
    time : float [s]
    noise : float [mm of a human head]
        Distance of the markers from the solved face in this frame (RMS), at least that of a marker.
    markers, solved, corrected : PoseVerdict
        Units of the markers, of the solved face, and of the corrected one.
    """

    emotion: str
    frame: int
    time: float
    noise: float
    markers: PoseVerdict
    solved: PoseVerdict
    corrected: PoseVerdict

    @property
    def lost(self) -> tuple[str, ...]:
        """Units that the markers show and the corrected face does not."""
        measured = {amount.unit for amount in self.markers.expected if amount.done}
        return tuple(unit for unit in self.corrected.missing if unit in measured)

    def as_dict(self) -> dict[str, Any]:
        """Return the verdict as plain values."""
        return {
            "emotion": self.emotion,
            "frame": self.frame,
            "time_s": round(self.time, 4),
            "noise_mm": round(self.noise, 3),
            "lost": list(self.lost),
            "markers": self.markers.as_dict(),
            "solved": self.solved.as_dict(),
            "corrected": self.corrected.as_dict(),
        }


@dataclass(frozen=True, eq=False, slots=True)
class FacsReport:
    """A rig judged by action units.

    Attributes
    ----------
    rig : Rig
    points : FeaturePoints
    shapes : ShapeVerdicts
    poses : tuple of PoseVerdict
    peaks : tuple of PeakVerdict
    noise : float [mm of a human head]
        Of a marker coordinate.
    """

    rig: Rig
    points: FeaturePoints
    shapes: ShapeVerdicts
    poses: tuple[PoseVerdict, ...]
    noise: float
    peaks: tuple[PeakVerdict, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """Return the report as plain values."""
        counts: dict[str, int] = {}
        for shape in self.shapes.verdicts:
            counts[shape.verdict] = counts.get(shape.verdict, 0) + 1
        return {
            "noise_mm": round(self.noise, 3),
            "usual_miss": round(self.shapes.usual, 3),
            "counts": counts,
            "shapes": [shape.as_dict() for shape in self.shapes.verdicts],
            "poses": [pose.as_dict() for pose in self.poses],
            "peaks": [peak.as_dict() for peak in self.peaks],
        }


def judge_rig(rig: Rig, expressions: Sequence[Expression]) -> FacsReport:
    """Judge the blend shapes of a rig and its expression poses by the noise of usual markers.

    Parameters
    ----------
    rig : Rig
        Judged as if its face looked along +z.
    expressions : sequence of Expression

    Raises
    ------
    InputError
        If the face shows no lids and lips, so that its feature points are not found.
    """
    rig = rig_to_front(rig)
    points, names = find_feature_points(rig), rig.shape_names
    largest = np.zeros(len(names))
    row = {name: i for i, name in enumerate(names)}
    for mesh in rig.meshes:
        for shape in mesh.shapes:
            ways = [shape.offsets, *(between.offsets for between in shape.inbetweens)]
            size = max(float(np.linalg.norm(way, axis=1).max(initial=0.0)) for way in ways)
            largest[row[shape.name]] = max(largest[row[shape.name]], size / points.unit)
    shapes = judge_shapes(names, points.moved(rig, names), largest, _MM * MARKER_NOISE)
    weights = _pose_weights(names, expressions)
    poses = tuple(
        judge_pose(one.name, moved, units_expected(one.name), _MM * MARKER_NOISE, shapes.large)
        for one, moved in zip(expressions, points.displaced(rig, names, weights), strict=True)
    )
    return FacsReport(rig, points, shapes, poses, _MM * MARKER_NOISE)


def _pose_weights(names: Sequence[str], expressions: Sequence[Expression]) -> FloatArray:
    """Return the weights of expression poses over blend shapes: (E, S)."""
    weights = np.zeros((len(expressions), len(names)))
    column = {name: i for i, name in enumerate(names)}
    for pose, expression in zip(weights, expressions, strict=True):
        for shape, weight in zip(expression.shapes, expression.weights, strict=True):
            if shape in column:
                pose[column[shape]] = weight
    return weights


def facs_findings(report: FacsReport) -> Iterator[Finding]:
    """Yield a finding for each faulty blend shape, incomplete pose and unit lost at a peak."""
    for shape in report.shapes.verdicts:
        found = _shape_finding(shape)
        if found is not None:
            yield found
    for pose in report.poses:
        if pose.missing:
            message = "the expression pose does not show {units}"
            yield finding("FACS_POSE_INCOMPLETE", pose.name, message, _units(pose.missing))
    for peak in report.peaks:
        if peak.lost:
            message = "{units} seen at the markers, not on the face, where {emotion} peaks"
            yield finding(
                "FACS_UNIT_LOST",
                f"frame {peak.frame}",
                message,
                _units(peak.lost),
                peak.emotion,
            )


def _shape_finding(shape: ShapeVerdict) -> Finding | None:
    """Return the finding of a faulty blend shape; None if it is right or its name has no unit."""
    own, shown = _words(shape.claim), _words(shape.shown)
    match shape.verdict:
        case "dead" if shape.claim:
            message = "it moves nothing farther than {largest_mm:.2f} mm"
            return finding("FACS_SHAPE_DEAD", shape.name, message, shape.largest_mm)
        case "other_side":
            message = "it does {shown}, the mirror image of {unit}"
            return finding("FACS_SIDE_OTHER", shape.name, message, shown, own)
        case "swapped":
            message = "it does {shown}, and {shape!r} does that of its own name"
            return finding("FACS_SHAPES_SWAPPED", shape.name, message, shown, shape.partner)
        case "other_unit":
            message = "it does {shown} (fit {shown_fit:.2f}), not {unit} (fit {fit:.2f})"
            values = shown, shape.shown_fit, own, shape.fit
            return finding("FACS_UNIT_OTHER", shape.name, message, *values)
        case "mixed":
            message = "it does {shown}, and also {second}"
            return finding("FACS_UNITS_MIXED", shape.name, message, shown, _words(shape.second))
        case "not_done":
            message = (
                "the points of {unit} moved {moved_mm:.1f} mm in its directions (fit {fit:.2f})"
            )
            return finding(
                "FACS_UNIT_NOT_DONE", shape.name, message, own, shape.moved_mm, shape.fit
            )
        case _:
            return None


def _words(claim: Claim | None) -> str:
    return f"{claim} {claim.title}" if claim else "nothing that is known"


def _units(units: Sequence[str]) -> list[str]:
    return [f"AU{unit} {MOVEMENTS[unit].title}" if unit in MOVEMENTS else unit for unit in units]
