"""Why the corrector answers what it answers: features, memberships, rules, emotions, weights."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from usdface.arrays import FloatArray
from usdface.correction.expression_layer import expression_poses
from usdface.correction.feature_extraction import sided_features
from usdface.correction.features import face_unit
from usdface.correction.gains import Gains
from usdface.correction.pose_blend import respond
from usdface.correction.temporal_blend import blend_frames
from usdface.errors import InputError
from usdface.expression_system import ExpressionSystem
from usdface.face.mirror import Side
from usdface.fuzzy.inference import evaluate
from usdface.fuzzy.membership import membership
from usdface.fuzzy.norms import HEDGES
from usdface.fuzzy.rules import Proposition
from usdface.io.usd.shot import Shot
from usdface.retarget.neutral import on_plane
from usdface.retarget.solution import Solution
from usdface.retarget_setup import Expression, RetargetSetup
from usdface.retarget_shot import Animated
from usdface.rigs import Mesh
from usdface.takes import WeightsTake

__all__ = ["ASIDE", "Explanation", "Heard", "explained"]

# Weights that the corrector moves by less are not worth a line.
_VISIBLE = 0.005
# A half of the face is spoken of where it is shown this much more or less of a pose than the whole.
ASIDE = 0.1


@dataclass(frozen=True, eq=False, slots=True)
class Heard:
    """What the system hears of one half of the face, as if the other did the same.

    Attributes
    ----------
    inputs, firing, outputs, shown
        As those of `Explanation`, which are of the face as it is.
    """

    inputs: FloatArray
    firing: FloatArray
    outputs: FloatArray
    shown: FloatArray


@dataclass(frozen=True, eq=False, slots=True)
class Explanation:
    """What the corrector saw and did over a take.

    Attributes
    ----------
    system : ExpressionSystem
    times : (F,) float64 [s]
    inputs : (F, I) float64
        Features, in the system's face unit; columns as `FuzzySystem.inputs`.
    firing : (F, R) float64
    outputs : (F, E) float64
        Emotions; columns as `ExpressionSystem.emotions`.
    shapes : tuple of str, length T
    solved, corrected : (F, T) float64
        Weights before and after.
    markers : tuple of str, length I
        The marker that each input reads.
    nose_tip : str
        The marker that distances are measured to.
    unit : float [m]
        What the inputs are divided by.
    poses : (E, T) float64
        Weights of each emotion's pose.
    shown : (F, E) float64
        How much of its pose each emotion of the whole face is given; gains of regions are left out.
    halves : mapping of "left", "right" to Heard
        What shapes of that half follow; those of neither follow what both say. Empty where the
        shot has no sides: then all follow the whole face.
    sides : mapping of str to "left" or "right"
        The half of each shape that belongs to one.
    """

    system: ExpressionSystem
    times: FloatArray
    inputs: FloatArray
    firing: FloatArray
    outputs: FloatArray
    shapes: tuple[str, ...]
    solved: FloatArray
    corrected: FloatArray
    markers: tuple[str, ...]
    nose_tip: str
    unit: float
    poses: FloatArray
    shown: FloatArray
    halves: Mapping[Side, Heard] = field(default_factory=dict)
    sides: Mapping[str, Side] = field(default_factory=dict)

    @property
    def peak(self) -> int:
        """The frame in which the strongest emotion is strongest, on the face or on a half of it.

        0 where there is none.
        """
        heard = (self.outputs, *(half.outputs for half in self.halves.values()))
        return int(np.max([each.max(axis=1, initial=0.0) for each in heard], axis=0).argmax())

    def frame_at(self, seconds: float) -> int:
        """Return the frame nearest to a time of the take.

        Raises
        ------
        InputError
            If the time lies outside the take by more than half a frame.
        """
        first, last = float(self.times[0]), float(self.times[-1])
        slack = float(np.median(np.diff(self.times))) / 2 if len(self.times) > 1 else 0.0
        if not first - slack <= seconds <= last + slack:
            raise InputError(
                f"there is no frame at {seconds:g} s; the take goes from {first:g} to {last:g} s"
            )
        return int(np.abs(self.times - seconds).argmin())

    def frame(self, index: int) -> dict[str, Any]:
        """Return one frame as plain values for people and JSON.

        Of the halves of the face only those that are shown more or less than the whole.

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
        return {
            "frame": index,
            "seconds": round(float(self.times[index]), 4),
            "emotions": self._by_emotion(self.outputs[index]),
            "poses shown": self._by_emotion(self.shown[index]),
            "nothing fires": not self.firing[index].any(),
            "rules": self._rules(self.firing[index], self.inputs[index]),
            "halves": {
                side: {
                    "emotions": self._by_emotion(half.outputs[index]),
                    "poses shown": self._by_emotion(half.shown[index]),
                    "rules": self._rules(half.firing[index], half.inputs[index]),
                }
                for side, half in self.halves.items()
                if np.abs(half.shown[index] - self.shown[index]).max(initial=0.0) >= ASIDE
            },
            "features": [self._feature(index, i) for i in range(len(self.system.fuzzy.inputs))],
            "weights": {
                self.shapes[s]: {
                    "solved": round(float(self.solved[index, s]), 4),
                    "corrected": round(float(self.corrected[index, s]), 4),
                    "by": self._cause(index, int(s)),
                }
                for s in moved
            },
        }

    def _by_emotion(self, values: FloatArray) -> dict[str, float]:
        """Return the values of a frame (E,) by name."""
        pairs = zip(self.system.emotions, values, strict=True)
        return {name: round(float(value), 4) for name, value in pairs}

    def _rules(self, firing: FloatArray, inputs: FloatArray) -> list[dict[str, Any]]:
        """Return the rules with what they ask for, the strongest of a frame first."""
        rules = [
            {
                "rule": " ".join(rule.text.split()),
                "fires": round(float(strength), 4),
                "weight": rule.weight,
                "enabled": rule.enabled,
                "conditions": [self._condition(inputs, p) for p in rule.propositions],
            }
            for rule, strength in zip(self.system.fuzzy.rules, firing, strict=True)
        ]
        return sorted(rules, key=lambda rule: -rule["fires"])

    def _cause(self, index: int, shape: int) -> str | None:
        """Return the emotion that asks most of a shape; where none does, that is blended in or out.

        None where none is near.
        """
        reach = blend_frames(self.times, self.system.blend_time)
        near = slice(max(0, index - reach), index + reach + 1)
        followed = self._followed(shape)
        for shown in (followed[index], followed[near].max(axis=0)):
            asked = shown * self.poses[:, shape]
            if asked.any():
                return self.system.emotions[int(asked.argmax())]
        return None

    def _followed(self, shape: int) -> FloatArray:
        """Return how much of each pose a shape is given (F, E): its half's, or what both say."""
        if not self.halves:
            return self.shown
        half = self.halves.get(self.sides.get(self.shapes[shape], "both"))
        if half is not None:
            return half.shown
        return np.asarray(np.min([half.shown for half in self.halves.values()], axis=0))

    def _feature(self, index: int, column: int) -> dict[str, Any]:
        variable, feature = self.system.fuzzy.inputs[column], self.system.features[column]
        value = self.inputs[index, column]
        return {
            "name": variable.name,
            "marker role": feature.role,
            "marker": self.markers[column],
            "measured to": self.nose_tip,
            "axis": feature.axis,
            "value": round(float(value), 5) if np.isfinite(value) else None,
            "mm": self._millimetres(value),
            "terms": {
                term.name: round(
                    float(membership(term.kind, term.parameters, np.array([value]))[0]), 4
                )
                for term in variable.terms
            },
        }

    def _millimetres(self, value: float) -> float | None:
        return round(1000.0 * self.unit * float(value), 3) if np.isfinite(value) else None

    def _condition(self, inputs: FloatArray, asked: Proposition) -> dict[str, Any]:
        column = [v.name for v in self.system.fuzzy.inputs].index(asked.variable)
        term = self.system.fuzzy.inputs[column].term(asked.term)
        value = inputs[column : column + 1]
        degree = membership(term.kind, term.parameters, value)
        for hedge in reversed(asked.hedges):
            degree = HEDGES[hedge](degree)
        return {
            "variable": asked.variable,
            "marker": self.markers[column],
            "mm": self._millimetres(value[0]),
            "is": " ".join((*asked.hedges, asked.term)),
            "degree": round(float(degree[0]), 4) if np.isfinite(value[0]) else 0.0,
        }


def explained(shot: Shot, system: ExpressionSystem, animated: Animated) -> Explanation:
    """Return what the corrector saw and did.

    Parameters
    ----------
    shot : Shot
    system : ExpressionSystem
        The shot's.
    animated : Animated
        What became of the shot.
    """
    mesh = shot.rig.mesh(shot.setup.binding.mesh)
    solution = animated.solve.solution
    weights = WeightsTake(animated.solve.names, shot.take.times, animated.solve.weights)
    read = (system, animated.take, mesh, shot.setup, weights, solution)
    inputs = sided_features(*read, shot.parts.heard)
    heard = {side: (seen, evaluate(system.fuzzy, seen)) for side, seen in inputs.items()}
    whole, answer = heard.pop("both")
    shown = partial(_shown, system, shot.gains, shot.expressions)
    sides: dict[str, Side] = dict.fromkeys(shot.parts.left, "left")
    sides |= dict.fromkeys(shot.parts.right, "right")
    return Explanation(
        system,
        shot.take.times,
        whole,
        answer.firing,
        answer.outputs,
        animated.solve.names,
        animated.solve.weights,
        animated.final.weights,
        tuple(shot.setup.roles.get(f.role, f.role) for f in system.features),
        shot.setup.nose_tip,
        _unit(system, mesh, shot.setup, solution),
        expression_poses(system, animated.solve.names, shot.expressions)[0],
        shown(answer.outputs),
        {
            side: Heard(seen, said.firing, said.outputs, shown(said.outputs))
            for side, (seen, said) in heard.items()
        },
        sides,
    )


def _shown(
    system: ExpressionSystem,
    gains: Gains | None,
    expressions: Sequence[Expression],
    outputs: FloatArray,
) -> FloatArray:
    known = gains or Gains.constant(system.gain, expressions)
    driven = outputs if system.mode == "add" else respond(outputs, system.response)
    own = known.of([(emotion, None) for emotion in system.emotions], len(outputs))
    return driven * own * known.system[:, None]


def _unit(
    system: ExpressionSystem, mesh: Mesh, setup: RetargetSetup, solution: Solution | None
) -> float:
    if system.space == "take" and solution is not None:
        return face_unit(system, on_plane(solution.neutral))
    return face_unit(system, mesh.points[setup.binding.points])
