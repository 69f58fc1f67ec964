"""The report of a retargeted shot: residuals, deviations, emotions, where markers would help."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from usdface.advice import advice
from usdface.binding.marker_places import FreePlaces, free_places
from usdface.closure.closed_eyes import CompletedClosing
from usdface.closure.lid_gaps import EYES
from usdface.errors import InputError
from usdface.face.bound_face import BoundFace
from usdface.findings import Finding
from usdface.retarget.map_choice import MapChoice
from usdface.retarget.solution import Solution
from usdface.retarget.solve_report import solve_report
from usdface.shot import ShotResult

__all__ = ["ShotReport", "report_of"]


@dataclass(frozen=True, slots=True)
class ShotReport:
    """The report of a shot.

    Attributes
    ----------
    summary : mapping of str to value
        A few numbers, see `usdface.Result`.
    details : mapping of str to value
        ``residual`` and ``confidence`` of a marker take; ``closings`` of its eyes.
    findings : tuple of Finding
        Blend shapes that the markers hardly see; ADVICE_FAILED for a part that is left out.
    """

    summary: dict[str, Any]
    details: dict[str, Any]
    findings: tuple[Finding, ...]


def report_of(result: ShotResult) -> ShotReport:
    """Report the residuals of a result and the deviations of its weights.

    Keys of the summary: ``frames``, ``rate_hz``, ``blend_shapes``; of a marker take
    ``markers_used``, ``space_map``, ``left_out_marker_mm`` (error of predicting a marker from the
    others), ``marker_noise_mm``, ``misfit_mm``, ``residual_mean_mm``, ``residual_p95_mm``,
    ``residual_max_mm``, ``worst_frame``, and those of `usdface.retarget.solve_report`; of a
    corrected one ``emotion_peaks`` and ``correction_max``; with a closure layer ``blinks``,
    ``eyes_held_closed`` and ``frames_with_closed_lips``, and ``closings`` in the details.
    """
    shot, solution = result.shot, result.solution
    summary: dict[str, Any] = {
        "frames": len(shot.take.times),
        "rate_hz": round(shot.take.rate, 3),
        "blend_shapes": len(result.solved.names),
    }
    details: dict[str, Any] = {}
    findings: tuple[Finding, ...] = ()
    if solution is not None:
        face = shot.face
        free, failed = _free_places(face, solution)
        report = solve_report(face, shot.setup, solution, free=free.vertices, room=free.room)
        details, findings = report.details, (*report.findings, *failed)
        summary |= _solution_summary(solution) | report.summary
    if result.corrected is not None:
        change = np.abs(result.corrected - result.solved.weights)
        summary["emotion_peaks"] = {
            name: round(float(curve.max()), 3) for name, curve in result.emotions.items()
        }
        summary["correction_max"] = round(float(change.max()), 3)
    if result.closure is not None:
        closings = result.closure.closings
        kinds = [each.closing.kind for each in closings]
        summary["blinks"], summary["eyes_held_closed"] = kinds.count("blink"), kinds.count("held")
        summary["frames_with_closed_lips"] = int((result.closure.mouth > 0).sum())
        details = details | {"closings": [_closing(each) for each in closings]}
    return ShotReport(summary, details, findings)


def _closing(completed: CompletedClosing) -> dict[str, Any]:
    """Return a closing of the eyes as plain values."""
    closing = completed.closing
    return {
        "kind": closing.kind,
        "eyes": [EYES[eye] for eye in closing.eyes],
        "frames": list(completed.frames),
        "closed_s": [round(closing.closed, 4), round(closing.opened, 4)],
        "peak": completed.peak,
        "seen": round(closing.height, 3),
        "one_eye_guessed": closing.guessed,
        "weight_before": [round(weight, 4) for weight in completed.before],
        "weight_after": [round(weight, 4) for weight in completed.after],
        "gap_mm": [round(1000.0 * gap, 3) for gap in completed.gaps],
    }


def _solution_summary(solution: Solution) -> dict[str, Any]:
    residual = 1000.0 * solution.residual
    return {
        "markers_used": len(solution.markers),
        **_map_summary(solution.choice),
        "marker_noise_mm": round(1000.0 * solution.noise, 4),
        "misfit_mm": round(1000.0 * solution.misfit, 3),
        "residual_mean_mm": round(float(residual.mean()), 3),
        "residual_p95_mm": round(float(np.percentile(residual, 95)), 3),
        "residual_max_mm": round(float(residual.max()), 3),
        "worst_frame": int(residual.argmax()),
    }


def _map_summary(choice: MapChoice) -> dict[str, Any]:
    if not np.isfinite(choice.error):
        return {"space_map": choice.name}
    return {
        "space_map": choice.name,
        "left_out_marker_mm": round(1000.0 * choice.error, 3),
        "left_out_marker_similarity_mm": round(1000.0 * choice.similarity_error, 3),
    }


def _free_places(face: BoundFace, solution: Solution) -> tuple[FreePlaces, list[Finding]]:
    nowhere = FreePlaces(np.zeros(0, dtype=np.int64), 0.0)

    def found() -> FreePlaces:
        try:
            return free_places(face.mesh, face.vertices_of(solution.markers))
        except InputError:  # a mesh that does not look forwards, or is no skin: nothing to suggest
            return nowhere

    return advice("next markers", found, nowhere)
