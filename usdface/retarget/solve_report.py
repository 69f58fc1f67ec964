"""The report of a solve: residuals in millimetres, standard deviations of the weights."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from usdface.advice import advice
from usdface.arrays import FloatArray, IntArray
from usdface.face.bound_face import BoundFace
from usdface.face.place import Place
from usdface.face.place_descriptions import places_of
from usdface.face.region_residuals import region_errors
from usdface.findings import Finding, finding
from usdface.findings.values import Prose
from usdface.geometry.marker_spread import rms_radius
from usdface.retarget.confidence import Confidence, confidence_of, within_bounds
from usdface.retarget.motion_model import MotionModel
from usdface.retarget.solution import Solution
from usdface.retarget.solver.regularisation import Regularisation
from usdface.retarget.solver.residual_space import EXPRESSIVE_QUANTILE
from usdface.rigs import Mesh
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import frame_step

__all__ = ["SolveReport", "solve_report", "usual_misfit"]

_NAMED = 3  # shapes on screen


@dataclass(frozen=True, slots=True)
class SolveReport:
    """Lines for the screen (`summary`), the whole of it for the report file, and findings."""

    summary: dict[str, Any]
    details: dict[str, Any]
    findings: list[Finding]


def solve_report(
    face: BoundFace,
    setup: RetargetSetup,
    solution: Solution,
    *,
    free: IntArray,
    room: float = 0.0,
) -> SolveReport:
    """Report residuals of the markers and standard deviations of the weights.

    Parts that fail are left out: ADVICE_FAILED.

    Parameters
    ----------
    face : BoundFace
        Of the setup's binding.
    setup : RetargetSetup
    solution : Solution
    free : (N,) int64
        Vertices for more markers.
    room : float [m]
        Least distance between two of them.
    """
    nothing = SolveReport({}, {}, [])
    residual, failed = advice("residual", lambda: _residual_report(face, solution), nothing)
    confidence, confidence_failed = advice(
        "confidence", lambda: _confidence_report(face, setup, solution, free, room), nothing
    )
    return SolveReport(
        residual.summary | confidence.summary,
        residual.details | confidence.details,
        [*residual.findings, *confidence.findings, *failed, *confidence_failed],
    )


def _residual_report(face: BoundFace, solution: Solution) -> SolveReport:
    regions = region_errors(face, solution.markers, solution.distances)
    summary = {
        "residual_by_region_mm": {region: errors["rms"] for region, errors in regions.items()}
    }
    details = {
        "residual": {
            "markers_mm": _of_markers(solution),
            "regions_mm": regions,
            "frames_mm": np.round(1000.0 * solution.residual, 3).tolist(),
        }
    }
    return SolveReport(summary, details, [])


def _confidence_report(
    face: BoundFace, setup: RetargetSetup, solution: Solution, free: IntArray, room: float
) -> SolveReport:
    bound = face.vertices_of(solution.markers)
    places = np.concatenate([bound, np.setdiff1d(free, bound)])
    held = _usual(solution, setup, face)
    confidence = _confidence(face.mesh, solution, held, places, room)
    deviations = within_bounds(confidence.deviations, solution.weights.weights, held)
    names = face.shape_names
    helpful = {
        names[shape]: None if place is None else int(places[place])
        for shape in confidence.undetermined.tolist()
        for place in [confidence.remedies.get(shape)]
    }
    wanted = [int(places[place]) for place in confidence.places]
    least = np.argsort(-deviations, kind="stable")[:_NAMED]
    there = np.array(
        list(
            dict.fromkeys([*(vertex for vertex in helpful.values() if vertex is not None), *wanted])
        ),
        dtype=np.int64,
    )
    named = dict(zip(there.tolist(), places_of(face, there), strict=True))
    summary: dict[str, Any] = {
        "weight_deviation_median": round(float(np.median(deviations)), 3),
        "least_certain": {names[s]: round(float(deviations[s]), 2) for s in least.tolist()},
    }
    if wanted:
        summary["next_markers"] = [named[vertex].as_dict() for vertex in wanted]
    details = {
        "confidence": {
            "standard_deviation": {
                name: round(float(value), 4) for name, value in zip(names, deviations, strict=True)
            },
            "undetermined": helpful,
            "next_marker_vertices": wanted,
            "places": [place.as_dict() for place in named.values()],
        },
    }
    found = [
        _undetermined(names[shape], named[int(places[place])] if place is not None else None)
        for shape, place in confidence.remedies.items()
    ]
    return SolveReport(summary, details, found)


def _undetermined(shape: str, place: Place | None) -> Finding:
    """Return the finding on a shape that markers hardly determine, and the place of a remedy."""
    if place is None:
        message = "hardly determined by the markers, nor by any single one more"
        return finding("SHAPE_UNDETERMINED", shape, message)
    message = (
        "hardly determined by the markers; one more marker would determine most of it here: {place}"
    )
    return finding("SHAPE_UNDETERMINED", shape, message, Prose(place), **place.as_dict())


def _usual(solution: Solution, setup: RetargetSetup, face: BoundFace) -> Regularisation:
    """Return the regularisation of a typical frame, for all shapes of the face."""
    misfit, names = usual_misfit(solution), face.shape_names
    size = rms_radius(solution.rest)
    return Regularisation(solution.noise, misfit, setup.solve, names, solution.covariance, size)


def _confidence(
    mesh: Mesh,
    solution: Solution,
    held: Regularisation,
    places: IntArray,
    room: float,
) -> Confidence:
    """Return the confidence of the weights with markers on the first of the `places`."""
    return confidence_of(
        MotionModel.linear(
            mesh.points[places],
            mesh.offsets_at(places),
            solution.dimension,
            solution.head == "solve",
        ),
        np.arange(len(solution.markers)),
        frame_step(solution.weights.times),
        held,
        room=room,
        errors=solution.errors,
    )


def usual_misfit(solution: Solution) -> float:
    """Return the misfit of a marker coordinate over all frames, not only expressive ones [m]."""
    squares = solution.residual**2
    most = float(np.quantile(squares, EXPRESSIVE_QUANTILE))
    return solution.misfit * float(np.sqrt(min(1.0, squares.mean() / most))) if most else 0.0


def _of_markers(solution: Solution) -> dict[str, dict[str, float]]:
    seen = ~np.isnan(solution.distances)
    distances = 1000.0 * np.where(seen, solution.distances, 0.0)
    mean: FloatArray = np.sqrt((distances**2).sum(axis=0) / np.maximum(seen.sum(axis=0), 1))
    worst = distances.argmax(axis=0)
    return {
        name: {
            "rms": round(float(mean[m]), 3),
            "worst": round(float(distances[worst[m], m]), 3),
            "worst_frame": int(worst[m]),
        }
        for m, name in enumerate(solution.markers)
        if seen[:, m].any()  # else visible only in frames without a head pose
    }
