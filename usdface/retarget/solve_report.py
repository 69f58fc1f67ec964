"""What a solve has to say for itself: residuals in millimetres, how sure the weights are."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from usdface.advice import advice
from usdface.findings import Finding, finding
from usdface.retarget.confidence import Confidence, confidence_of, within_bounds
from usdface.retarget.noise import MOST
from usdface.retarget.regions import place_names, region_errors
from usdface.retarget.regularisation import Regularisation
from usdface.retarget.solution import Solution
from usdface.rigs import Mesh
from usdface.setup import Setup
from usdface.takes import FloatArray, IntArray

__all__ = ["SolveReport", "solve_report", "usual_misfit"]

_NAMED = 3


@dataclass(frozen=True, slots=True)
class SolveReport:
    """Lines for the screen (`summary`), the whole of it for the report file, and findings."""

    summary: dict[str, Any]
    details: dict[str, Any]
    findings: list[Finding]


def solve_report(
    mesh: Mesh, setup: Setup, solution: Solution, free: IntArray, room: float = 0.0
) -> SolveReport:
    """Say how far markers are from the solved face, and how far its weights can be off.

    What of this cannot be said is left out: ADVICE_FAILED.

    Parameters
    ----------
    mesh : Mesh
    setup : Setup
        Fitted to the mesh (`usdface.setup.fit_setup`).
    solution : Solution
    free : (N,) int64
        Vertices where more markers could be glued, so far apart as
    room : float [m]
    """
    nothing = SolveReport({}, {}, [])
    off, failed = advice("residual", lambda: _residuals(mesh, setup, solution), nothing)
    sure, more = advice(
        "confidence", lambda: _certainty(mesh, setup, solution, free, room), nothing
    )
    return SolveReport(
        off.summary | sure.summary,
        off.details | sure.details,
        [*off.findings, *sure.findings, *failed, *more],
    )


def _residuals(mesh: Mesh, setup: Setup, solution: Solution) -> SolveReport:
    regions = region_errors(mesh, setup.binding, solution)
    summary = {
        "residual mm, by region": ", ".join(f"{r} {e['rms']:.2f}" for r, e in regions.items())
    }
    details = {
        "residual": {
            "markers mm": _of_markers(solution),
            "regions mm": regions,
            "frames mm": np.round(1000.0 * solution.residual, 3).tolist(),
        }
    }
    return SolveReport(summary, details, [])


def _certainty(
    mesh: Mesh, setup: Setup, solution: Solution, free: IntArray, room: float
) -> SolveReport:
    vertex = dict(zip(setup.binding.markers, setup.binding.points.tolist(), strict=True))
    bound = np.array([vertex[name] for name in solution.markers])
    places = np.concatenate([bound, np.setdiff1d(free, bound)])
    sure = _confidence(mesh, setup, solution, places, room)
    deviations = within_bounds(sure.deviations, solution.weights.weights)
    names = mesh.shape_names
    hidden = {names[shape]: sure.unseen.get(shape) for shape in sure.hidden.tolist()}
    unseen = {name: int(places[place]) for name, place in hidden.items() if place is not None}
    wanted = [int(places[place]) for place in sure.places]
    least = np.argsort(-deviations, kind="stable")[:_NAMED]
    there = np.array(list(dict.fromkeys([*unseen.values(), *wanted])), dtype=np.int64)
    named = dict(zip(there.tolist(), place_names(mesh, there, setup.binding), strict=True))
    summary: dict[str, Any] = {
        "weights, standard deviation": round(float(np.median(deviations)), 3),
        "least sure": ", ".join(f"{names[s]} {deviations[s]:.2f}" for s in least),
    }
    if wanted:
        summary["next markers"] = "; ".join(named[vertex] for vertex in wanted)
    details = {
        "confidence": {
            "standard deviation": {
                name: round(float(value), 4) for name, value in zip(names, deviations, strict=True)
            },
            "hardly seen, and the vertex that would show it": {**dict.fromkeys(hidden), **unseen},
            "next markers, vertices": wanted,
            "where these are": {str(vertex): where for vertex, where in named.items()},
        },
    }
    found = [
        finding(
            "SHAPE_UNSURE",
            name,
            f"hardly seen; a marker would tell most of it here: {named[vertex]}",
        )
        for name, vertex in unseen.items()
    ]
    return SolveReport(summary, details, found)


def _confidence(
    mesh: Mesh, setup: Setup, solution: Solution, places: IntArray, room: float
) -> Confidence:
    """Say how sure the weights are with markers on the first of the `places`."""
    times, axes = solution.weights.times, 3 if solution.in_space else 2
    step = float(np.median(np.diff(times))) if len(times) > 1 else 0.0
    misfit, covariance = usual_misfit(solution), solution.covariance
    return confidence_of(
        mesh.points[places],
        mesh.offsets_at(places),
        np.arange(len(solution.markers)),
        axes,
        setup.head == "solve",
        step,
        Regularisation(solution.noise, misfit, setup.solve, covariance=covariance),
        room=room,
    )


def usual_misfit(solution: Solution) -> float:
    """Return the misfit of a marker coordinate over all frames, not the expressive ones [m]."""
    squares = solution.residual**2
    most = float(np.quantile(squares, MOST))
    return solution.misfit * float(np.sqrt(min(1.0, squares.mean() / most))) if most else 0.0


def _of_markers(solution: Solution) -> dict[str, dict[str, float]]:
    seen = ~np.isnan(solution.distances)
    distances = 1000.0 * np.where(seen, solution.distances, 0.0)
    mean: FloatArray = np.sqrt((distances**2).sum(axis=0) / seen.sum(axis=0))
    worst = distances.argmax(axis=0)
    return {
        name: {
            "rms": round(float(mean[m]), 3),
            "worst": round(float(distances[worst[m], m]), 3),
            "worst frame": int(worst[m]),
        }
        for m, name in enumerate(solution.markers)
    }
