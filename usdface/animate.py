"""A shot's animation: the retarget, then the corrector over it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from usdface.cleanup.clean import Cleaned, clean_take
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.fuzzy.correct import correct
from usdface.fuzzy.design import design_system
from usdface.fuzzy.doubts import rule_findings
from usdface.fuzzy.features import face_unit, measure, smooth
from usdface.fuzzy.inference import evaluate
from usdface.fuzzy.naming import known_roles
from usdface.fuzzy.system import FuzzySystem
from usdface.io.usd.layers import Animation, complete_weights
from usdface.io.usd.shot import Shot
from usdface.io.usd.stage import Stage
from usdface.options import FEATURE_SMOOTHING, CleanOptions, CorrectionOptions, ProcessOptions
from usdface.outcome import Steps
from usdface.retarget.align import Pose
from usdface.retarget.head_motion import head_motion
from usdface.retarget.map_choice import MapChoice
from usdface.retarget.names import rename_weights
from usdface.retarget.neutral import on_plane
from usdface.retarget.pins import bent_to_pins, kept_at_pins
from usdface.retarget.solve_report import solve_report
from usdface.retarget.transfer import Solution, solve_take
from usdface.rigs import Mesh
from usdface.setup import Expression, Setup, fit_setup
from usdface.takes import FloatArray, MarkerTake, WeightsTake, visible

__all__ = [
    "MARKER_NOISE",
    "Animated",
    "adopt",
    "animate",
    "design",
    "express",
    "features",
    "retarget",
]

# What optical markers jitter by [m]; features that move less tell nothing.
MARKER_NOISE = 0.0003


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
        take, cleaned, findings = _clean(shot.take, shot.setup)
        shot = replace(shot, take=take)
    with steps("solve"):
        weights, solution, more = _solve(take, shot.setup, mesh, shot.rig.shape_names, cleaned)
        findings += more
        names, complete = complete_weights(stage, shot, weights.names, weights.weights)
        others = [pin for pin in shot.setup.pins if pin.shape not in weights.names]
        complete = bent_to_pins(others, names, take.times, complete)
        repairs = cleaned.repairs if cleaned else ()
        solved = Animation(
            names, complete, solution, {}, repairs, _motion(shot, mesh, solution, options)
        )
    if not options.express:
        return _animated(shot, solved, None, findings)
    if shot.system is None or not shot.expressions:
        return _animated(shot, solved, None, [*findings, finding("EXPRESS_SKIPPED", "")])
    with steps("express"):
        inputs = features(shot.system, shot.take, mesh, shot.setup, weights, solution)
        corrected, emotions, more = express(shot.system, inputs, names, complete, shot.expressions)
        pins, times = shot.setup.pins, shot.take.times
        corrected = kept_at_pins(pins, names, times, complete, corrected)
    expressed = Animation(names, corrected, None, emotions)
    return _animated(shot, solved, expressed, findings + more)


def _as_told(setup: Setup, options: ProcessOptions) -> Setup:
    """Return the setup with what the run says otherwise."""
    if not options.clean:
        setup = replace(setup, clean=CleanOptions(swaps=False, spikes=False, gaps=False))
    if options.solve is not None:
        setup = replace(setup, solve=replace(setup.solve, mode=options.solve))
    return setup


def retarget(
    take: MarkerTake | WeightsTake, setup: Setup, mesh: Mesh, shape_names: tuple[str, ...]
) -> tuple[MarkerTake | WeightsTake, WeightsTake, Solution | None, list[Finding]]:
    """Clean a take and solve its weights on the bound mesh.

    Parameters
    ----------
    take : MarkerTake or WeightsTake
    setup : Setup
    mesh : Mesh
        The one that the markers are bound to.
    shape_names : tuple of str
        Blend shapes of the whole rig, for a take of weights.

    Returns
    -------
    take : MarkerTake or WeightsTake
        Its markers cleaned.
    weights : WeightsTake
    solution : Solution or None
        None for a take of weights.
    findings : list of Finding
    """
    take, cleaned, findings = _clean(take, setup)
    weights, solution, more = _solve(take, setup, mesh, shape_names, cleaned)
    return take, weights, solution, findings + more


def _clean(
    take: MarkerTake | WeightsTake, setup: Setup
) -> tuple[MarkerTake | WeightsTake, Cleaned | None, list[Finding]]:
    if isinstance(take, WeightsTake):
        return take, None, []
    on_the_face = (*setup.binding.markers, *setup.head_markers)
    moving = setup.head != "stabilised"
    cleaned, findings = clean_take(take, on_the_face, setup.clean, moving)
    return cleaned.take, cleaned, findings


def _solve(
    take: MarkerTake | WeightsTake,
    setup: Setup,
    mesh: Mesh,
    shape_names: tuple[str, ...],
    cleaned: Cleaned | None,
) -> tuple[WeightsTake, Solution | None, list[Finding]]:
    if isinstance(take, WeightsTake):
        weights, findings = rename_weights(take, shape_names)
        bent = bent_to_pins(setup.pins, weights.names, weights.times, weights.weights)
        return replace(weights, weights=bent), None, findings
    setup, findings = fit_setup(setup, mesh, take)
    points = setup.binding.points
    if cleaned is not None:
        # What was filled in is no observation: the rig knows better what is hidden.
        take = replace(
            take, positions=np.where(cleaned.measured[..., None], take.positions, np.nan)
        )
    solution, more = solve_take(
        take, mesh.points[points], mesh.offsets_at(points), mesh.shape_names, setup
    )
    curved = [shape.name for shape in mesh.shapes if shape.inbetweens]
    if curved:
        more.append(finding("INBETWEEN_IGNORED", mesh.path, f"shapes: {', '.join(curved)}"))
    return solution.weights, solution, findings + more


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
    details: dict[str, Any] = {}
    if solve.solution is not None:
        mesh = shot.rig.mesh(shot.setup.binding.mesh)
        report = solve_report(mesh, shot.setup, solve.solution)
        findings, details = findings + report.findings, report.details
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


def _map_summary(choice: MapChoice) -> dict[str, Any]:
    if not np.isfinite(choice.error):
        return {"space map": choice.name}
    return {
        "space map": choice.name,
        "left-out marker mm": round(1000.0 * choice.error, 3),
        "left-out marker mm, similarity": round(1000.0 * choice.similarity_error, 3),
    }


def design(
    mesh: Mesh, setup: Setup, expressions: Sequence[Expression], correction: CorrectionOptions
) -> tuple[FuzzySystem | None, Setup, list[Finding]]:
    """Design the default system from the expression poses, on the bound markers.

    Returns
    -------
    FuzzySystem or None
        None without markers or expressions.
    Setup
        With the roles that the system's variables name; those it has already win.
    list of Finding
        EXPRESS_SKIPPED where there is no system.
    """
    points = setup.binding.points
    if not len(points) or not expressions:
        return None, setup, [finding("EXPRESS_SKIPPED", mesh.path)]
    system, roles, findings = design_system(
        setup.binding.markers,
        mesh.points[points],
        mesh.offsets_at(points),
        mesh.shape_names,
        expressions,
        setup.nose_tip,
        MARKER_NOISE,
    )
    system = replace(system, mode=correction.mode, gain=correction.gain)
    return system, replace(setup, roles=roles | dict(setup.roles)), findings


def adopt(system: FuzzySystem, setup: Setup, where: str) -> Setup:
    """Give the roles that a system names to bound markers: those of the setup, or by label.

    Raises
    ------
    InputError
        If a role has no marker; `where` names the system.
    """
    known = known_roles(setup.binding.markers, setup.roles)
    asked = dict.fromkeys(v.role for v in system.inputs)
    for role in asked:
        if role not in known:
            raise InputError(
                f"{where}: the fuzzy system reads the marker role {role!r}, which no bound marker "
                f'has; give it one in the binding, "roles": {{"{role}": "..."}}'
            )
    return replace(setup, roles=dict(setup.roles) | {role: known[role] for role in asked})


def features(
    system: FuzzySystem,
    take: MarkerTake | WeightsTake,
    mesh: Mesh,
    setup: Setup,
    weights: WeightsTake,
    solution: Solution | None,
) -> FloatArray:
    """Measure the inputs in the space the system asks for, smoothed as noise demands: (F, I).

    Raises
    ------
    InputError
        If the space is the take's and the take has no markers.
    """
    if system.space == "take":
        if solution is None or not isinstance(take, MarkerTake):
            raise InputError(
                "the fuzzy system reads the take's markers, but the take has weights only; "
                'set its space to "character"'
            )
        names, neutral = solution.markers, on_plane(solution.neutral)
        positions = solution.pose.to_head(on_plane(take.select(names)))
    else:
        names, points = setup.binding.markers, setup.binding.points
        neutral = mesh.points[points]
        offsets = mesh.offsets_at(points).reshape(len(mesh.shapes), -1)
        positions = neutral + (weights.weights @ offsets).reshape(-1, *neutral.shape)
    unit = face_unit(system, neutral)
    read = measure(positions, neutral, names, system.inputs, setup.roles, setup.nose_tip, unit)
    # As in the solve: what was recorded without noise is read frame by frame.
    noise = min(solution.noise / MARKER_NOISE, 1.0) if solution else 0.0
    return smooth(read, take.times, noise * FEATURE_SMOOTHING)


def express(
    system: FuzzySystem,
    inputs: FloatArray,
    names: tuple[str, ...],
    weights: FloatArray,
    expressions: Sequence[Expression],
) -> tuple[FloatArray, dict[str, FloatArray], list[Finding]]:
    """Correct weights (F, T) of shapes `names` by what the system reads off `inputs` (F, I).

    Returns
    -------
    corrected : (F, T) float64 in [0, 1]
    emotions : dict of str to (F,) float64
    findings : list of Finding
    """
    findings = rule_findings(system)
    outputs = evaluate(system, inputs).outputs
    poses, gains = np.zeros((len(system.emotions), len(names))), np.ones(len(system.emotions))
    by_name = {expression.name: expression for expression in expressions}
    for row, emotion in enumerate(system.emotions):
        expression = by_name.get(emotion)
        if expression is None:
            findings.append(
                finding("EXPRESSION_UNKNOWN", emotion, f"no expression pose for {emotion!r}")
            )
            continue
        poses[row], gains[row] = expression.pose(names), expression.gain
        for shape in set(expression.shapes) - set(names):
            findings.append(finding("SHAPE_UNKNOWN", shape, f"{emotion!r} names it"))
    corrected = correct(weights, outputs, poses, gains, system.mode, system.gain)
    return corrected, dict(zip(system.emotions, outputs.T, strict=True)), findings
