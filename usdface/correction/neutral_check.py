"""Outputs of fuzzy systems for a neutral face: the paper's system, as printed, and a shot's."""

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
from usdface.retarget_take.clean_and_solve import clean_and_solve
from usdface.rigs import Rig
from usdface.rule_design.paper_system import paper_system
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake

__all__ = ["NeutralResponse", "neutral_responses"]

# Long enough to contain rare peaks of the jitter; the first second is the neutral.
_SECONDS, _RATE = 20, 30.0


@dataclass(frozen=True, slots=True)
class NeutralResponse:
    """The outputs of one system for a neutral face.

    Attributes
    ----------
    system : str
        Its name, for people.
    exact : dict of str to float
        Each emotion where every feature is 0.
    mean, largest : dict of str to float, or None
        Each emotion over a take of neutral markers with 0.3 mm of noise on a human face, solved as
        any other; None where the system is not the shot's, or reads markers that are not bound.
    rules : tuple of str
        Those that fire where every feature is 0.
    """

    system: str
    exact: dict[str, float]
    mean: dict[str, float] | None
    largest: dict[str, float] | None
    rules: tuple[str, ...]

    def as_dict(self) -> dict[str, Any]:
        """Return the outputs as plain values for JSON."""
        return {
            "system": self.system,
            "neutral": self.exact,
            "jitter_mean": self.mean,
            "jitter_max": self.largest,
            "rules_firing": self.rules,
        }


def neutral_responses(
    rig: Rig, setup: RetargetSetup, system: ExpressionSystem
) -> tuple[NeutralResponse, ...]:
    """Evaluate the paper's system, and a shot's system on its rig and setup, on a neutral face."""
    outputs = _jitter(rig, setup, system)
    return _response("the paper's", paper_system()), _response("the shot's", system, outputs)


def _response(
    name: str, system: ExpressionSystem, simulated: FloatArray | None = None
) -> NeutralResponse:
    def named(values: FloatArray) -> dict[str, float]:
        return {e: round(float(v), 4) for e, v in zip(system.emotions, values, strict=True)}

    return NeutralResponse(
        name,
        named(evaluate(system.fuzzy, np.zeros((1, len(system.features)))).outputs[0]),
        None if simulated is None else named(simulated.mean(axis=0)),
        None if simulated is None else named(simulated.max(axis=0)),
        tuple(" ".join(rule.text.split()) for rule in fires_at_neutral(system)),
    )


def _jitter(rig: Rig, setup: RetargetSetup, system: ExpressionSystem) -> FloatArray | None:
    """Return the emotions (F, E) of a simulated take: the neutral face with marker noise."""
    binding = setup.binding
    roles = {setup.roles.get(f.role, f.role) for f in system.features}
    if not binding.markers or not roles <= set(binding.markers):
        return None
    mesh = rig.mesh(binding.mesh)
    first, frames = round(_RATE), round((1 + _SECONDS) * _RATE)
    # Neutral weights and calibration are those of a performer, not of the character.
    setup = replace(setup, neutral_weights={}, calibration=None, pins=())
    own = replace(setup.solve, neutral="given")
    setup = replace(setup, neutral=(0, first - 1), head="solve", solve=own)
    face = bound_face(mesh, setup, rig_shapes=rig.shape_names)
    jitter = np.random.default_rng(0).standard_normal((frames, *face.neutral.shape))
    positions = face.neutral + face.size * MARKER_NOISE * jitter
    take = MarkerTake(binding.markers, np.arange(frames) / _RATE, positions, _RATE)
    taken, weights, solution, _ = clean_and_solve(take, face, setup)
    inputs = features(system, face, taken, weights=weights, solution=solution)
    return evaluate(system.fuzzy, inputs).outputs[first:]
