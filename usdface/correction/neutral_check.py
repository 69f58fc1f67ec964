"""What systems answer to a neutral face: the fuzzy paper's, as printed, beside a shot's."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from usdface.arrays import FloatArray
from usdface.correction.feature_extraction import features
from usdface.correction.rule_check import fires_at_neutral
from usdface.expression_system import ExpressionSystem
from usdface.face.bound_face import bound_face
from usdface.fuzzy.inference import evaluate
from usdface.options import MARKER_NOISE
from usdface.retarget_setup import RetargetSetup
from usdface.retarget_take import retarget
from usdface.rigs import Rig
from usdface.rule_design.paper_system import paper_system
from usdface.takes import MarkerTake

__all__ = ["RestingAnswer", "resting_answers"]

# Long enough for the rarest excess of jitter to show; the first second tells the neutral.
_SECONDS, _RATE = 20, 30.0


@dataclass(frozen=True, slots=True)
class RestingAnswer:
    """What one system answers to a neutral face.

    Attributes
    ----------
    system : str
        What people call it.
    exact : dict of str to float
        Each emotion where every feature is 0.
    mean, largest : dict of str to float, or None
        Each emotion while resting markers jitter by 0.3 mm, recorded and solved as any take; None
        where that cannot be played.
    rules : tuple of str
        Those that fire where every feature is 0.
    """

    system: str
    exact: dict[str, float]
    mean: dict[str, float] | None
    largest: dict[str, float] | None
    rules: tuple[str, ...]

    def as_dict(self) -> dict[str, Any]:
        """Return the answer as plain values for JSON."""
        return {
            "system": self.system,
            "neutral": self.exact,
            "jitter, mean": self.mean,
            "jitter, largest": self.largest,
            "rules that fire": self.rules,
        }


def resting_answers(
    rig: Rig, setup: RetargetSetup, system: ExpressionSystem
) -> tuple[RestingAnswer, ...]:
    """Ask the paper's system, and the one of a shot of that rig and setup, about a neutral face."""
    heard = _jitter(rig, setup, system)
    return _answer("the paper's", paper_system()), _answer("the shot's", system, heard)


def _answer(name: str, system: ExpressionSystem, heard: FloatArray | None = None) -> RestingAnswer:
    def named(values: FloatArray) -> dict[str, float]:
        return {e: round(float(v), 4) for e, v in zip(system.emotions, values, strict=True)}

    return RestingAnswer(
        name,
        named(evaluate(system.fuzzy, np.zeros((1, len(system.features)))).outputs[0]),
        None if heard is None else named(heard.mean(axis=0)),
        None if heard is None else named(heard.max(axis=0)),
        tuple(" ".join(rule.text.split()) for rule in fires_at_neutral(system)),
    )


def _jitter(rig: Rig, setup: RetargetSetup, system: ExpressionSystem) -> FloatArray | None:
    """Record the character's own face at rest, with noise; return the emotions (F, E)."""
    binding = setup.binding
    roles = {setup.roles.get(f.role, f.role) for f in system.features}
    if not binding.markers or not roles <= set(binding.markers):
        return None
    mesh = rig.mesh(binding.mesh)
    first, frames = round(_RATE), round((1 + _SECONDS) * _RATE)
    rest = mesh.points[binding.points]
    jitter = np.random.default_rng(0).standard_normal((frames, *rest.shape))
    take = MarkerTake(
        binding.markers, np.arange(frames) / _RATE, rest + MARKER_NOISE * jitter, _RATE
    )
    # What a performer showed in the neutral frames, and how large, is no matter of this face.
    setup = replace(setup, neutral_weights={}, calibration=None, pins=())
    setup = replace(setup, neutral=(0, first - 1), head="solve")
    face = bound_face(mesh, setup, rig_shapes=rig.shape_names)
    taken, weights, solution, _ = retarget(take, face, setup)
    inputs = features(system, face, taken, weights=weights, solution=solution)
    return evaluate(system.fuzzy, inputs).outputs[first:]
