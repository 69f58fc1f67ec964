"""The explanation of a correction: features, memberships, rules, emotions and weights of a frame.

All values come from the trace of the expression layer; nothing is evaluated again.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from usdface.arguments import checked
from usdface.arrays import BoolArray, FloatArray
from usdface.correction.expression_layer import ExpressionTrace, SideTrace
from usdface.correction.temporal_blend import blend_frames
from usdface.errors import InputError
from usdface.expression_system import ExpressionSystem
from usdface.fuzzy.rules import Proposition
from usdface.numerics.local_maxima import highest
from usdface.shot.shot import ShotResult
from usdface.takes.frame_index import check_frame, frame_at

__all__ = ["HALF_APART", "Explanation", "explain_result"]

# Least visible change of a weight: half a step of a percent slider.
_VISIBLE = 0.005
# A half of the face is listed if the intensity of a pose differs by this much from the whole.
HALF_APART = 0.1


@dataclass(frozen=True, eq=False, slots=True)
class Explanation:
    """A retargeted shot with the trace of its correction, frame by frame.

    Attributes
    ----------
    result : ShotResult
    trace : ExpressionTrace
        Of `result`, with memberships.

    Examples
    --------
    >>> explanation = usdface.explain("examples/shot.usda").value
    >>> explanation.frame(explanation.peak)["rules"][0]["fires"] > 0
    True
    """

    result: ShotResult
    trace: ExpressionTrace

    @property
    def system(self) -> ExpressionSystem:
        """The fuzzy system."""
        return self.trace.system

    @property
    def times(self) -> FloatArray:
        """Times of the frames: (F,) [s]."""
        return self.result.solved.times

    @property
    def whole(self) -> SideTrace:
        """The evaluation of the whole face."""
        return self.trace.sides["both"]

    @property
    def halves(self) -> dict[str, SideTrace]:
        """The evaluation of each half; empty where no blend shape belongs to one."""
        return {side: traced for side, traced in self.trace.sides.items() if side != "both"}

    @property
    def peak(self) -> int:
        """The frame of the largest emotion, held back or not.

        Of the whole face, or of a half in frames that list it, if that is larger. 0 without
        emotions; where one stays as large, the middle.
        """
        largest = self.whole.evaluation.outputs.max(axis=1, initial=0.0)
        for half in self.halves.values():
            listed = half.evaluation.outputs.max(axis=1, initial=0.0) * self._apart(half)
            if listed.max() > largest.max():
                largest = listed
        return highest(largest) if largest.any() else 0

    def _apart(self, half: SideTrace) -> BoolArray:
        """Return the frames (F,) in which a pose on a half has another intensity than the whole."""
        difference = np.abs(half.intensity - self.whole.intensity)
        return np.asarray(difference.max(axis=1, initial=0.0) >= HALF_APART)

    def frame_at(self, seconds: float) -> int:
        """Return the frame nearest to a time of the take.

        Raises
        ------
        InputError
            If the time lies outside the take by more than half a frame.
        """
        return frame_at(self.times, seconds)

    def frame(self, index: int) -> dict[str, Any]:
        """Return one frame as plain values for people and JSON.

        Halves of the face are included where their intensities differ from those of the whole.

        Raises
        ------
        InputError
            If the take has no such frame.
        """
        check_frame(self.times, index)
        return {
            "frame": index,
            "time_s": round(float(self.times[index]), 4),
            **self._side(self.whole, index),
            "nothing_fires": not (
                self.trace.firing[index].any() or self.whole.evaluation.outputs[index].any()
            ),
            "halves": {
                side: self._side(half, index)
                for side, half in self.halves.items()
                if self._apart(half)[index]
            },
            "features": [self._feature(index, i) for i in range(len(self.system.fuzzy.inputs))],
            "closed": self._closed(index),
            "weights": self._weights(index),
        }

    def _closed(self, index: int) -> dict[str, float]:
        """Return how far the closure layer closes each eye and the mouth; without those at 0."""
        closure = self.result.closure
        if closure is None:
            return {}
        left, right = closure.eyes[index].tolist()
        parts = {"left eye": left, "right eye": right, "mouth": float(closure.mouth[index])}
        return {name: round(share, 4) for name, share in parts.items() if share >= _VISIBLE}

    def _side(self, traced: SideTrace, index: int) -> dict[str, Any]:
        """Return emotions, intensities of their poses, and rules of the whole face or of a half."""
        return {
            "emotions": self._by_emotion(traced.evaluation.outputs[index]),
            "by_rules": self._by_emotion(traced.by_rules[index]),
            "poses_shown": self._by_emotion(traced.intensity[index]),
            "held_back": self._held_back(traced, index),
            "rules": self._rules(traced, index),
        }

    def _held_back(self, traced: SideTrace, index: int) -> dict[str, list[str]]:
        """Return the regions that held an emotion back, as they do not match its pose."""
        regions: dict[str, list[str]] = {
            name: [str(region) for region, frames in traced.missing.items() if frames[index, row]]
            for row, name in enumerate(self.system.emotions)
        }
        return {name: listed for name, listed in regions.items() if listed}

    def _weights(self, index: int) -> dict[str, dict[str, Any]]:
        """Return the weights that correction and closure move, the largest change first."""
        solved, corrected = self.result.solved, self.result.weights
        change = corrected.weights[index] - solved.weights[index]
        closing = np.zeros(len(change))
        if self.result.corrected is not None:
            closing = corrected.weights[index] - self.result.corrected[index]
        moved = sorted(np.flatnonzero(np.abs(change) >= _VISIBLE), key=lambda s: -abs(change[s]))
        return {
            solved.names[s]: {
                "solved": round(float(solved.weights[index, s]), 4),
                "corrected": round(float(corrected.weights[index, s]), 4),
                "by": "closure"
                if abs(closing[s]) > abs(change[s]) / 2
                else self._cause(index, int(s)),
            }
            for s in moved
        }

    def _by_emotion(self, values: FloatArray) -> dict[str, float]:
        """Return the values of a frame (E,) by name."""
        pairs = zip(self.system.emotions, values, strict=True)
        return {name: round(float(value), 4) for name, value in pairs}

    def _rules(self, traced: SideTrace, index: int) -> list[dict[str, Any]]:
        """Return the rules with their conditions, the strongest of a frame first."""
        rules = [
            {
                "rule": " ".join(rule.text.split()),
                "fires": round(float(strength), 4),
                "weight": rule.weight,
                "enabled": rule.enabled,
                "conditions": [self._condition(traced, index, p) for p in rule.propositions],
            }
            for rule, strength in zip(
                self.system.fuzzy.rules, traced.evaluation.firing[index], strict=True
            )
        ]
        return sorted(rules, key=lambda rule: -rule["fires"])

    def _cause(self, index: int, shape: int) -> str | None:
        """Return the emotion that raises a blend shape most, here or within the blend time.

        None where none does.
        """
        reach = blend_frames(self.times, self.system.blend_time)
        nearby = slice(max(0, index - reach), index + reach + 1)
        intensity = self._intensity_of(shape)
        for own in (intensity[index], intensity[nearby].max(axis=0)):
            requested = own * self.trace.poses[:, shape]
            if requested.any():
                return self.system.emotions[int(requested.argmax())]
        return None

    def _intensity_of(self, shape: int) -> FloatArray:
        """Return the intensities (F, E) of a blend shape: of its half, or the smaller ones."""
        if not self.halves:
            return self.whole.intensity
        name, layout = self.result.solved.names[shape], self.result.shot.layout
        if name in layout.left:
            return self.halves["left"].intensity
        if name in layout.right:
            return self.halves["right"].intensity
        return np.asarray(np.min([half.intensity for half in self.halves.values()], axis=0))

    def _feature(self, index: int, column: int) -> dict[str, Any]:
        variable, feature = self.system.fuzzy.inputs[column], self.system.features[column]
        value = self.whole.inputs[index, column]
        memberships = self.whole.evaluation.memberships
        return {
            "name": variable.name,
            "role": feature.role,
            "marker": self.trace.markers[column],
            "measured_to": self.result.shot.setup.nose_tip,
            "axis": feature.axis,
            "value": round(float(value), 5) if np.isfinite(value) else None,
            "mm": self._millimetres(value),
            "terms": {
                term.name: round(
                    float(memberships[Proposition(variable.name, term.name)][index]), 4
                )
                for term in variable.terms
            },
        }

    def _millimetres(self, value: float) -> float | None:
        return round(1000.0 * self.trace.unit * float(value), 3) if np.isfinite(value) else None

    def _condition(self, traced: SideTrace, index: int, proposition: Proposition) -> dict[str, Any]:
        column = [v.name for v in self.system.fuzzy.inputs].index(proposition.variable)
        return {
            "variable": proposition.variable,
            "marker": self.trace.markers[column],
            "mm": self._millimetres(traced.inputs[index, column]),
            "is": " ".join((*proposition.hedges, proposition.term)),
            "degree": round(float(traced.evaluation.memberships[proposition][index]), 4),
        }


@checked
def explain_result(result: ShotResult) -> Explanation:
    """Return the explanation of a shot that was retargeted with ``ProcessOptions(trace=True)``.

    Parameters
    ----------
    result : ShotResult

    Returns
    -------
    Explanation

    Raises
    ------
    InputError
        If the shot has no expression layer, or was retargeted without a trace.

    Examples
    --------
    >>> options = usdface.ProcessOptions(trace=True)
    >>> result = usdface.process("examples/shot.usda", options=options).value
    >>> round(usdface.explain_result(result).frame(72)["poses_shown"]["joy"], 2)
    0.99
    """
    trace = result.trace
    if trace is None:
        raise InputError(
            "the shot has no expression layer to explain; give it a fuzzy system and expressions"
        )
    if trace.system.fuzzy.rules and not trace.sides["both"].evaluation.memberships:
        raise InputError("the trace has no memberships; retarget with ProcessOptions(trace=True)")
    return Explanation(result, trace)
