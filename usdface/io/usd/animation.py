"""The content of each layer of a result: weights, head motion, residuals, emotions."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from usdface.arrays import FloatArray
from usdface.cleanup.repairs import Repair
from usdface.geometry.rigid_fit import Pose
from usdface.retarget.joint_motion import JointMotion
from usdface.retarget.solution import Solution
from usdface.schemas import tokens
from usdface.shot.shot import ShotResult
from usdface.verdict.judge import Verdict

__all__ = ["Animation", "Inputs", "closure_animation", "express_animation", "solve_animation"]


class Inputs(NamedTuple):
    """Inputs of a fuzzy system (F, I), and the length that they are divided by [m]."""

    values: FloatArray
    unit: float


@dataclass(frozen=True, eq=False, slots=True)
class Animation:
    """The content of one layer.

    Attributes
    ----------
    names : tuple of str, length T
        Blend shape tokens of the animation.
    weights : (F, T) float64
    solution : Solution or None
        Head pose, residual and feature points, for the solve layer.
    emotions : mapping of str to (F,) float64
        Emotion curves, for the express layer.
    firing : (F, R) float64 or None
        Firing strength of each rule, for the express layer.
    regions : mapping of str to (F,) float64 [m]
        Residual of each region of the face, for the solve layer.
    repairs : tuple of Repair
        Changes of the marker clean-up, for the solve layer.
    inputs : Inputs or None
        Inputs of the fuzzy system, for the express layer.
    deviations : mapping of str to float
        Standard deviation of the weight of each solved blend shape, for the solve layer.
    closure : mapping of str to (F,) float64
        How far each eye and the mouth are closed, by attribute, for the closure layer.
    motion : Pose or None
        Motion of the character's head, if any, for the solve layer.
    eyes : tuple of JointMotion
        Motion of the joints that turn the eyes, for the solve layer.
    verdict : Verdict or None
        On the result, for the solve layer.
    """

    names: tuple[str, ...]
    weights: FloatArray
    solution: Solution | None
    emotions: Mapping[str, FloatArray] = field(default_factory=dict)
    repairs: tuple[Repair, ...] = ()
    motion: Pose | None = None
    eyes: tuple[JointMotion, ...] = ()
    firing: FloatArray | None = None
    regions: Mapping[str, FloatArray] = field(default_factory=dict)
    closure: Mapping[str, FloatArray] = field(default_factory=dict)
    inputs: Inputs | None = None
    deviations: Mapping[str, float] = field(default_factory=dict)
    verdict: Verdict | None = None


def solve_animation(
    result: ShotResult,
    deviations: Mapping[str, float],
    verdict: Verdict | None,
) -> Animation:
    """Return the content of the solve layer: weights before the correction."""
    solved = result.solved
    return Animation(
        solved.names,
        solved.weights,
        result.solution,
        repairs=result.repairs,
        motion=result.head_motion,
        eyes=result.eye_motions,
        regions=result.region_residuals,
        deviations=deviations,
        verdict=verdict,
    )


def express_animation(result: ShotResult) -> Animation | None:
    """Return the content of the express layer; None where nothing was corrected."""
    if result.corrected is None or result.trace is None:
        return None
    return Animation(
        result.solved.names,
        result.corrected,
        None,
        result.emotions,
        firing=result.trace.firing,
        inputs=Inputs(result.trace.sides["both"].inputs, result.trace.unit),
    )


def closure_animation(result: ShotResult) -> Animation | None:
    """Return the content of the closure layer; None where nothing closes."""
    closure = result.closure
    if closure is None:
        return None
    curves = {
        tokens.CLOSURE_LEFT_EYE: closure.eyes[:, 0],
        tokens.CLOSURE_RIGHT_EYE: closure.eyes[:, 1],
        tokens.CLOSURE_MOUTH: closure.mouth,
    }
    return Animation(result.solved.names, closure.weights, None, closure=curves)
