"""Why the corrector answers what it answers: features, memberships, rules, emotions, weights."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from usdface.animate import animate
from usdface.errors import InputError
from usdface.express import features
from usdface.fuzzy.inference import evaluate
from usdface.fuzzy.membership import membership
from usdface.fuzzy.system import FuzzySystem
from usdface.io.usd.layers import layer_paths
from usdface.io.usd.shot import read_shot
from usdface.io.usd.stage import open_stage
from usdface.options import ProcessOptions
from usdface.outcome import Steps
from usdface.takes import FloatArray, WeightsTake

__all__ = ["Explanation", "explain_shot"]

# Weights that the corrector moves by less are not worth a line.
_VISIBLE = 0.005


@dataclass(frozen=True, eq=False, slots=True)
class Explanation:
    """What the corrector saw and did over a take.

    Attributes
    ----------
    system : FuzzySystem
    times : (F,) float64 [s]
    inputs : (F, I) float64
        Features, in the system's face unit; columns as `FuzzySystem.inputs`.
    firing : (F, R) float64
    outputs : (F, E) float64
        Emotions; columns as `FuzzySystem.emotions`.
    shapes : tuple of str, length T
    solved, corrected : (F, T) float64
        Weights before and after.
    """

    system: FuzzySystem
    times: FloatArray
    inputs: FloatArray
    firing: FloatArray
    outputs: FloatArray
    shapes: tuple[str, ...]
    solved: FloatArray
    corrected: FloatArray

    def frame(self, index: int) -> dict[str, Any]:
        """Return one frame as plain values for people and JSON.

        Raises
        ------
        InputError
            If the take has no such frame.
        """
        count = len(self.times)
        if not 0 <= index < count:
            raise InputError(f"there is no frame {index}; the take has frames 0 to {count - 1}")
        change = self.corrected[index] - self.solved[index]
        moved = sorted(np.flatnonzero(np.abs(change) >= _VISIBLE), key=lambda s: -abs(change[s]))
        rules = [
            {"rule": rule.text, "fires": round(float(strength), 4), "enabled": rule.enabled}
            for rule, strength in zip(self.system.rules, self.firing[index], strict=True)
        ]
        return {
            "frame": index,
            "seconds": round(float(self.times[index]), 4),
            "emotions": {
                name: round(float(value), 4)
                for name, value in zip(self.system.emotions, self.outputs[index], strict=True)
            },
            "rules": sorted(rules, key=lambda rule: -rule["fires"]),
            "features": [self._feature(index, i) for i in range(len(self.system.inputs))],
            "weights": {
                self.shapes[s]: {
                    "solved": round(float(self.solved[index, s]), 4),
                    "corrected": round(float(self.corrected[index, s]), 4),
                }
                for s in moved
            },
        }

    def _feature(self, index: int, column: int) -> dict[str, Any]:
        variable, value = self.system.inputs[column], self.inputs[index, column]
        return {
            "name": variable.name,
            "marker role": variable.role,
            "axis": variable.axis,
            "value": round(float(value), 5) if np.isfinite(value) else None,
            "terms": {
                term.name: round(
                    float(membership(term.kind, term.parameters, np.array([value]))[0]), 4
                )
                for term in variable.terms
            },
        }


def explain_shot(path: Path, steps: Steps) -> Explanation:
    """Process a shot without writing anything, and keep what the corrector saw.

    Raises
    ------
    InputError
        If the shot cannot be processed or has no fuzzy system.
    """
    with steps("read"):
        ours = layer_paths(path, None)
        stage = open_stage(path, without=(ours.solve, ours.express))
        shot, _ = read_shot(stage, str(path))
    if shot.system is None:
        raise InputError(f"{path} has no fuzzy system to explain; `usdface shot` designs one")
    animated = animate(stage, shot, ProcessOptions(), steps)
    mesh = shot.rig.mesh(shot.setup.binding.mesh)
    solution = animated.solve.solution
    solved = WeightsTake(animated.solve.names, shot.take.times, animated.solve.weights)
    weights = solved.reordered(mesh.shape_names)
    inputs = features(shot.system, animated.take, mesh, shot.setup, weights, solution)
    answer = evaluate(shot.system, inputs)
    return Explanation(
        shot.system,
        shot.take.times,
        inputs,
        answer.firing,
        answer.outputs,
        animated.solve.names,
        animated.solve.weights,
        animated.final.weights,
    )
