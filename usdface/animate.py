"""A shot's animation: the retarget, then the corrector over it."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from usdface.advice import advice
from usdface.binding.marker_places import FreePlaces, free_places
from usdface.clean_solve import clean, solve
from usdface.errors import InputError
from usdface.express import Character, express
from usdface.findings import Finding, finding
from usdface.io.usd.animation import Animation, complete_weights
from usdface.io.usd.shot import Shot
from usdface.io.usd.stage import Stage
from usdface.options import CleanOptions, ProcessOptions
from usdface.outcome import Steps
from usdface.reading import sided_features
from usdface.retarget.align import Pose
from usdface.retarget.head_motion import head_motion
from usdface.retarget.map_choice import MapChoice
from usdface.retarget.pins import bent_to_pins, kept_at_pins
from usdface.retarget.regions import region_residuals
from usdface.retarget.shape_model import with_combinations
from usdface.retarget.solution import Solution
from usdface.retarget.solve_report import solve_report
from usdface.rigs import Mesh
from usdface.setup import Setup
from usdface.takes import FloatArray, MarkerTake, WeightsTake, visible

__all__ = ["Animated", "animate"]


@dataclass(frozen=True, eq=False, slots=True)
class Animated:
    """What `animate` made.

    Attributes
    ----------
    solve : Animation
        For the solve layer.
    express : Animation or None
        For the express layer; None where nothing corrects.
    take : MarkerTake or WeightsTake
        The shot's take, its markers cleaned.
    findings : list of Finding
    summary : mapping of str to value
    details : mapping of str to value
        What is too long for the screen.
    """

    solve: Animation
    express: Animation | None
    take: MarkerTake | WeightsTake
    findings: list[Finding]
    summary: dict[str, Any]
    details: dict[str, Any]

    @property
    def final(self) -> Animation:
        """The stronger of the two."""
        return self.express or self.solve

    @property
    def weights(self) -> WeightsTake:
        """The final weights over time [s]."""
        return WeightsTake(self.final.names, self.take.times, self.final.weights)


def animate(stage: Stage, shot: Shot, options: ProcessOptions, steps: Steps) -> Animated:
    """Solve the take's weights on the shot's rig, and correct them unless told not to."""
    mesh = shot.rig.mesh(shot.setup.binding.mesh)
    shot = replace(shot, setup=_as_told(shot.setup, options))
    with steps("clean"):
        take, cleaned, findings = clean(shot.take, shot.setup)
        shot = replace(shot, take=take)
    with steps("solve"):
        weights, solution, more = solve(take, shot.setup, mesh, shot.rig.shape_names, cleaned)
        findings += more
        names, complete = complete_weights(stage, shot, weights.names, weights.weights)
        others = [pin for pin in shot.setup.pins if pin.shape not in weights.names]
        complete = bent_to_pins(others, names, take.times, complete)
        repairs = cleaned.repairs if cleaned else ()
        motion = _motion(shot, mesh, solution, options)
        regions, more = _regions(mesh, shot.setup, solution)
        findings += more
        solved = Animation(names, complete, solution, {}, repairs, motion, regions=regions)
    if not options.express:
        return _animated(shot, solved, None, findings)
    if shot.system is None or not shot.expressions:
        return _animated(shot, solved, None, [*findings, finding("EXPRESS_SKIPPED", "")])
    with steps("express"):
        read = (shot.system, take, mesh, shot.setup, weights, solution)
        said = express(
            shot.system,
            sided_features(*read, shot.parts.heard),
            names,
            complete,
            shot.expressions,
            Character(mesh, shot.parts, shot.gains),
            take.times,
        )
        corrected = kept_at_pins(shot.setup.pins, names, take.times, complete, said.weights)
        corrected = with_combinations(mesh, names, corrected)
    expressed = Animation(names, corrected, None, said.emotions, firing=said.firing)
    return _animated(shot, solved, expressed, findings + said.findings)


def _as_told(setup: Setup, options: ProcessOptions) -> Setup:
    """Return the setup with what the run says otherwise."""
    if not options.clean:
        setup = replace(setup, clean=CleanOptions(swaps=False, spikes=False, gaps=False))
    if options.solve is not None:
        setup = replace(setup, solve=replace(setup.solve, mode=options.solve))
    return setup


def _motion(
    shot: Shot, mesh: Mesh, solution: Solution | None, options: ProcessOptions
) -> Pose | None:
    setup = shot.setup
    wanted = options.head and setup.move_head and setup.head != "stabilised"
    if solution is None or not (wanted and solution.in_space):
        return None
    vertex = dict(zip(setup.binding.markers, setup.binding.points.tolist(), strict=True))
    target = mesh.points[[vertex[name] for name in solution.markers]]
    times = solution.weights.times
    seen = ~np.isnan(solution.distances)
    if setup.head == "markers" and isinstance(shot.take, MarkerTake):
        rigid = visible(shot.take.select(setup.head_markers)).sum(axis=1) >= 3
        seen = np.broadcast_to(rigid[:, None], seen.shape)
    return head_motion(solution.pose, times, solution.neutral, target, solution.noise, seen)


def _animated(
    shot: Shot, solve: Animation, express: Animation | None, findings: list[Finding]
) -> Animated:
    summary: dict[str, Any] = {
        "frames": len(shot.codes),
        "rate Hz": round(shot.take.rate, 3),
        "blend shapes": solve.weights.shape[1],
    }
    if solve.motion is not None and shot.prims.head is not None:
        summary["head moves"] = shot.prims.head.name
    details: dict[str, Any] = {}
    if solve.solution is not None:
        mesh = shot.rig.mesh(shot.setup.binding.mesh)
        free, failed = _free_places(mesh, shot.setup, solve.solution)
        report = solve_report(mesh, shot.setup, solve.solution, free.vertices, free.room)
        findings, details = findings + report.findings + failed, report.details
        residual = 1000.0 * solve.solution.residual
        summary |= {
            "markers used": len(solve.solution.markers),
            **_map_summary(solve.solution.choice),
            "marker noise mm": round(1000.0 * solve.solution.noise, 4),
            "misfit mm": round(1000.0 * solve.solution.misfit, 3),
            "residual mm, mean": round(float(residual.mean()), 3),
            "residual mm, 95 %": round(float(np.percentile(residual, 95)), 3),
            "residual mm, worst": round(float(residual.max()), 3),
            "worst frame": int(residual.argmax()),
            **report.summary,
        }
    if express is not None:
        change = np.abs(express.weights - solve.weights)
        summary |= {
            f"{name}, peak": round(float(curve.max()), 3)
            for name, curve in express.emotions.items()
        }
        summary["correction, largest"] = round(float(change.max()), 3)
    return Animated(solve, express, shot.take, findings, summary, details)


def _regions(
    mesh: Mesh, setup: Setup, solution: Solution | None
) -> tuple[dict[str, FloatArray], list[Finding]]:
    """Return the residual of each region, for those who look at the result."""
    if solution is None:
        return {}, []
    return advice(
        "residual of each region", lambda: region_residuals(mesh, setup.binding, solution), {}
    )


def _free_places(mesh: Mesh, setup: Setup, solution: Solution) -> tuple[FreePlaces, list[Finding]]:
    bound = zip(setup.binding.markers, setup.binding.points.tolist(), strict=True)
    used = np.array([vertex for name, vertex in bound if name in solution.markers], dtype=np.int64)
    nowhere = FreePlaces(np.zeros(0, dtype=np.int64), 0.0)

    def found() -> FreePlaces:
        try:
            return free_places(mesh, used)
        except InputError:  # a mesh that does not look forwards, or is no skin: nothing to suggest
            return nowhere

    return advice("next markers", found, nowhere)


def _map_summary(choice: MapChoice) -> dict[str, Any]:
    if not np.isfinite(choice.error):
        return {"space map": choice.name}
    return {
        "space map": choice.name,
        "left-out marker mm": round(1000.0 * choice.error, 3),
        "left-out marker mm, similarity": round(1000.0 * choice.similarity_error, 3),
    }
