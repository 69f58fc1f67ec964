"""The report of a retargeted shot: residuals, deviations, emotions, where markers would help."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from usdface.advice import advice
from usdface.binding.marker_places import FreePlaces, free_places
from usdface.closure.closed_eyes import CompletedClosing
from usdface.closure.lid_apertures import EYES
from usdface.errors import InputError
from usdface.face.bound_face import BoundFace
from usdface.face.regions import gain_region
from usdface.findings import Finding, finding
from usdface.options import EXAGGERATION_RANGE
from usdface.retarget.exaggeration import Exaggeration
from usdface.retarget.map_choice import MapChoice
from usdface.retarget.solution import Solution
from usdface.retarget.solve_report import solve_report
from usdface.retarget.travel import Travel, region_travel
from usdface.setup.setup_summary import neutral_summary
from usdface.shot.measures import shot_measures
from usdface.shot.shot import ShotResult
from usdface.takes import MarkerTake
from usdface.verdict.judge import Verdict, judge

__all__ = ["ShotReport", "report_of"]

# A region whose travel ratio is a smaller share of the requested size is reported, with a
# factor on its weights between these: more would enlarge something else. Set by hand: they only
# advise.
_MUTED = 0.7
_REMEDIES = (1.1, 2.0)


@dataclass(frozen=True, slots=True)
class ShotReport:
    """The report of a shot.

    Attributes
    ----------
    summary : mapping of str to value
        A few numbers, see `usdface.Result`.
    details : mapping of str to value
        ``residual``, ``confidence``, ``travel`` and ``travel_by_part`` of a marker take;
        ``closings`` of its eyes.
    findings : tuple of Finding
        Blend shapes that are undetermined, regions that are muted; ADVICE_FAILED for a part
        that is left out.
    verdict : Verdict or None
        None if it could not be given.
    """

    summary: dict[str, Any]
    details: dict[str, Any]
    findings: tuple[Finding, ...]
    verdict: Verdict | None = None


def report_of(result: ShotResult) -> ShotReport:
    """Report the residuals of a result and the deviations of its weights.

    Keys of the summary: ``frames``, ``rate_hz``, ``blend_shapes``; of a marker take
    ``neutral_frames`` (first and last, or "rig"), ``markers_used``, ``space_map``,
    ``left_out_marker_mm`` (error of predicting a marker from the others), ``marker_noise_mm``,
    ``misfit_mm``, ``residual_mean_mm``, ``residual_p95_mm``, ``residual_max_mm``, ``worst_frame``,
    ``travel_ratio_by_region`` (of the skin by that of the performer's markers,
    `usdface.retarget.travel`; before the correction), and those of `usdface.retarget.solve_report`;
    of a corrected one ``emotion_peaks`` and ``correction_max``; with a closure layer ``blinks``,
    ``eyes_held_closed`` and ``frames_with_closed_lips``.
    """
    shot, solution = result.shot, result.solution
    summary: dict[str, Any] = {
        "frames": len(shot.take.times),
        "rate_hz": round(shot.take.rate, 3),
        "blend_shapes": len(result.solved.names),
    }
    details: dict[str, Any] = {}
    findings: tuple[Finding, ...] = ()
    if isinstance(shot.take, MarkerTake) and solution is not None:
        face = shot.face
        free, failed = _free_places(face, solution)
        report = solve_report(face, shot.setup, solution, free=free.vertices, room=free.room)
        travel = _travel_report(result, shot.take, solution)
        details = report.details | travel.details
        findings = (*report.findings, *failed, *travel.findings)
        summary["neutral_frames"] = neutral_summary(shot.setup)
        summary |= _solution_summary(solution) | report.summary | travel.summary
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
    verdict, failed = advice("verdict", lambda: _verdict(result, summary, details), None)
    return ShotReport(summary, details, (*findings, *failed), verdict)


def _verdict(result: ShotResult, summary: dict[str, Any], details: dict[str, Any]) -> Verdict:
    """Return the verdict on a result by its measures and those of its report."""
    travels = details.get("travel_by_part", {})
    ratios = {
        part: t["ratio"] / requested
        for part, t in travels.items()
        if t["ratio"] is not None
        and (requested := _requested_size(result.shot.factors, part)) > 0.0
    }
    return judge(shot_measures(result, ratios, summary.get("weight_deviation_median", np.nan)))


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
        # Lids that touch may cross by less than is printed: + 0.0 makes -0.0 a plain zero.
        "gap_mm": [round(1000.0 * aperture, 3) + 0.0 for aperture in completed.apertures],
    }


def _solution_summary(solution: Solution) -> dict[str, Any]:
    residual = 1000.0 * solution.residual
    return {
        "markers_used": len(solution.markers),
        **_map_summary(solution.choice),
        **_place_summary(solution),
        "marker_noise_mm": round(1000.0 * solution.noise, 4),
        "misfit_mm": round(1000.0 * solution.misfit, 3),
        "residual_mean_mm": round(float(residual.mean()), 3),
        "residual_p95_mm": round(float(np.percentile(residual, 95)), 3),
        "residual_max_mm": round(float(residual.max()), 3),
        "worst_frame": int(residual.argmax()),
    }


def _place_summary(solution: Solution) -> dict[str, Any]:
    if not solution.shifts.any():
        return {}
    away = 1000.0 * np.linalg.norm(solution.shifts, axis=1)
    return {
        "place_shift_median_mm": round(float(np.median(away)), 2),
        "place_shift_max_mm": round(float(away.max()), 2),
    }


def _map_summary(choice: MapChoice) -> dict[str, Any]:
    if not np.isfinite(choice.error):
        return {"space_map": choice.as_dict()}
    return {
        "space_map": choice.as_dict(),
        "left_out_marker_mm": round(1000.0 * choice.error, 3),
        "left_out_marker_similarity_mm": round(1000.0 * choice.similarity_error, 3),
        **{f"map_unexplained_{k}": v for k, v in _unexplained(choice).items()},
    }


def _unexplained(choice: MapChoice) -> dict[str, float]:
    """Return the unexplained share of the motion with the map, and with the similarity."""
    if not choice.unexplained:
        return {}
    return {
        "share": round(choice.unexplained[choice.name], 4),
        "similarity_share": round(choice.unexplained["similarity"], 4),
    }


def _travel_report(result: ShotResult, take: MarkerTake, solution: Solution) -> ShotReport:
    face = result.shot.face
    weights = result.solved.reordered(face.shape_names).weights

    def measured() -> tuple[dict[str, Travel], dict[str, Travel]]:
        own, merged = region_travel(face, take, solution, weights, str, gain_region)
        return own, merged

    nothing: tuple[dict[str, Travel], dict[str, Travel]] = ({}, {})
    (travels, merged), failed = advice("travel", measured, nothing)
    if not travels:
        return ShotReport({}, {}, tuple(failed))
    ratios = {
        region: None if np.isnan(travel.ratio) else round(travel.ratio, 2)
        for region, travel in travels.items()
    }
    details = {
        "travel": {region: _travel_details(travel) for region, travel in travels.items()},
        "travel_by_part": {part: _travel_details(travel) for part, travel in merged.items()},
    }
    exaggeration = result.shot.factors
    muted = [
        _muted(region, travel, exaggeration)
        for region, travel in merged.items()
        if (requested := _requested_size(exaggeration, region)) > 0.0
        and travel.ratio < _MUTED * requested
    ]
    return ShotReport({"travel_ratio_by_region": ratios}, details, (*failed, *muted))


def _travel_details(travel: Travel) -> dict[str, Any]:
    details: dict[str, Any] = {
        "markers": travel.markers,
        "peak_mm": round(1000.0 * travel.peak, 3),
    }
    ratios = {
        "ratio": travel.ratio,
        "map_ratio": travel.map_ratio,
        "correlation": travel.correlation,
        "best_factor": travel.best_factor,
    }
    return details | {
        name: None if np.isnan(value) else round(value, 3) for name, value in ratios.items()
    }


def _requested_size(exaggeration: Exaggeration, region: str) -> float:
    """Return the factor that a region is to be played at, at most 1; 0 if it is held still.

    Factors above 1 count as 1: there weights are clipped at 1, and the region is not muted.
    """
    return min(exaggeration.mean_of("face") * exaggeration.mean_of(region), 1.0)


def _muted(region: str, travel: Travel, exaggeration: Exaggeration) -> Finding:
    """Return the finding on a region that moves less than requested, and the remedy.

    The advised factor keeps the requested size.
    """
    requested = _requested_size(exaggeration, region)
    message = "the skin travels {travel_ratio:.2f} of the performer's markers"
    values = {"travel_ratio": travel.ratio}
    if requested < 1.0:
        message += ", {asked_ratio:.2f} was requested"
        values["asked_ratio"] = requested
    (low, high), largest = _REMEDIES, EXAGGERATION_RANGE[1]
    missing = requested * travel.best_factor
    factor = exaggeration.mean_of(region) * missing
    option = f"--exaggeration {_of_face(exaggeration)}{region}={factor:.1f}"
    check = (
        "check the places of the markers, and whether the character has blend shapes for this "
        "motion"
    )
    if round(factor, 1) > largest:
        message += (
            f", only a factor of {factor:.1f} would do, beyond the {largest:g} of --exaggeration: "
            f"{check}"
        )
    elif missing > high:
        message += f", only {option} would do: {check}"
    elif missing >= low:
        message += f"; {option} comes nearest to {'that' if requested < 1.0 else 'them'}"
    else:
        message += f", and no factor brings it nearer: {check}"
    return finding(
        "REGION_MUTED", region, message, *values.values(), region=region, best_factor=factor
    )


def _of_face(exaggeration: Exaggeration) -> str:
    """Return the face's factor as --exaggeration has it before those of regions; "" if none."""
    curve = exaggeration.parts.get("face")
    if curve is None or (curve == 1.0).all() or np.ptp(curve) > 0.0:
        return ""  # a changing one is on the shot, and stays there
    return f"{curve[0]:g},"


def _free_places(face: BoundFace, solution: Solution) -> tuple[FreePlaces, list[Finding]]:
    nowhere = FreePlaces(np.zeros(0, dtype=np.int64), 0.0)

    def found() -> FreePlaces:
        try:
            return free_places(face.mesh, face.vertices_of(solution.markers))
        except InputError:  # a mesh that does not look forwards, or is no skin: nothing to suggest
            return nowhere

    return advice("next markers", found, nowhere)
