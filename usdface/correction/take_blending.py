"""Blending the poses of a system over a whole take: by event, or by the paper's addition."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.correction.evidence import Evidence
from usdface.correction.gains import Gains
from usdface.correction.pose_blend import add_poses, ease_antagonists, pose_intensity
from usdface.correction.raised_events import RaisedEvents, raised_events
from usdface.correction.temporal_blend import blend_frames, blended
from usdface.expression_system import ExpressionSystem
from usdface.face.layout import FaceLayout, split_poses
from usdface.face.mirror import SIDES, Side, half_weights
from usdface.face.regions import GainRegion
from usdface.face.symmetry import symmetric_pairs
from usdface.numerics.ramps import linear_ramp
from usdface.takes import frame_step

__all__ = ["Blended", "MissingRegions", "Outputs", "TakeBlending"]

# The smaller output of the two halves by the larger, up to which each half is judged by itself, and
# from which on both are judged together. Set by hand.
_ALIKE = (0.5, 0.9)

# The outputs (F, E) of the whole face and of its halves.
Outputs = Mapping[Side, FloatArray]
# Frames (F, E) in which a region does not match the pose of an emotion.
MissingRegions = Mapping[GainRegion, BoolArray]


@dataclass(frozen=True, eq=False, slots=True)
class Blended:
    """Poses blended over a take.

    Attributes
    ----------
    weights : (F, T) float64
        In [0, 1].
    intensity : mapping of "both", "left", "right" to (F, E) float64
        The share of its pose that each emotion gets.
    missing : mapping of "both", "left", "right" to mapping of str to (F, E) bool
        Frames in which a region held an event back, see `usdface.correction.evidence`.
    """

    weights: FloatArray
    intensity: Outputs
    missing: Mapping[Side, MissingRegions]


@dataclass(frozen=True, eq=False, slots=True)
class TakeBlending:
    """The poses (E, T) of a system, and the weights (F, T) that they are blended over."""

    system: ExpressionSystem
    poses: FloatArray
    names: tuple[str, ...]
    layout: FaceLayout
    gains: Gains
    evidence: Evidence
    weights: FloatArray
    times: FloatArray | None

    @property
    def frames(self) -> int:
        """Frames over which a raised pose is blended in and out; 0 for independent frames."""
        if self.times is None or self.system.mode == "add":
            return 0
        return blend_frames(self.times, self.system.blend_time)

    def add(self, outputs: Outputs) -> Blended:
        """Blend with the paper's addition."""
        parts, frames = self._parts(), len(self.weights)
        drives, emotions = _driving(outputs), self.system.emotions
        strengths = np.array([drives[side][:, row] for row, side, _, _ in parts])
        strengths = strengths.reshape(len(parts), frames).T
        poses = np.array([pose for *_, pose in parts]).reshape(len(parts), len(self.names))
        regional = self.gains.of([(emotions[row], region) for row, _, region, _ in parts], frames)
        gain = self.gains.system
        from_rest = add_poses(np.zeros(self.weights.shape), strengths, poses, regional, gain)
        corrected = add_poses(self._eased(from_rest), strengths, poses, regional, gain)
        own = self.gains.of_emotions(emotions, frames)
        intensity = {side: pose_intensity(given, own, gain) for side, given in outputs.items()}
        return Blended(corrected, intensity, {side: {} for side in outputs})

    def raise_up(self, outputs: Outputs, by_rules: Outputs) -> Blended:
        """Raise weak expressions event by event; `by_rules` are the outputs of the rules alone."""
        added, reached = np.zeros(self.weights.shape), np.zeros(self.weights.shape)
        intensity = {side: np.zeros(given.shape) for side, given in outputs.items()}
        missing = {
            side: {region: np.zeros(given.shape, bool) for region in self.evidence.regions}
            for side, given in outputs.items()
        }

        def record(events: RaisedEvents, row: int, side: Side) -> None:
            intensity[side][:, row] = events.intensity(self._gain(row, None))
            for region, absent in missing[side].items():
                absent[:, row] = events.missing(region, len(absent))

        alike = _alike(outputs)
        raised = linear_ramp(_driving(outputs)["both"], *self.system.response)
        shared, shared_rules = (_shared(each, alike * raised) for each in (outputs, by_rules))
        drives, ruled = _driving(shared), _driving(shared_rules)
        unrecorded = [(row, side) for side in outputs for row in range(len(self.poses))]
        # The events of one emotion and side at a time: those of a long take are many.
        parts = sorted(self._parts(), key=_row_and_side)
        for (row, side), own in groupby(parts, _row_and_side):
            events = self._events(drives, ruled, alike, row, side)
            for *_, region, part in own:
                events.raise_part(part, self._gain(row, region), added, reached)
            if drives[side] is shared.get(side):
                record(events, row, side)
                unrecorded.remove((row, side))
        for row, side in unrecorded:
            record(self._events(shared, shared_rules, alike, row, side), row, side)
        eased = self._eased(reached)
        corrected = np.clip(eased + blended(added, self.frames, self.times), 0.0, 1.0)
        return Blended(corrected, intensity, missing)

    def _parts(self) -> list[tuple[int, Side, GainRegion | None, FloatArray]]:
        return split_poses(self.poses, self.names, self.layout)

    def _events(
        self, outputs: Outputs, by_rules: Outputs, alike: FloatArray, row: int, side: Side
    ) -> RaisedEvents:
        """Return an emotion's events on a side, of weights and pose mirrored to the other side.

        As far as both halves have the emotion alike (F, E), the mean of the two is the evidence:
        what is performed by both is not raised on one side alone.
        """
        output, ruled = outputs[side][:, row], by_rules[side][:, row]
        weights, pose = self.weights, self.poses[row]
        judged = weights
        if side != "both":
            pairs = symmetric_pairs(self.names)
            weights, (pose,) = (half_weights(w, pairs, side) for w in (weights, pose[None]))
            opposite: Side = "left" if side == "right" else "right"
            across = half_weights(self.weights, pairs, opposite)
            mixed = 0.5 * alike[:, row]
            judged = weights + mixed[:, None] * (across - weights)
        step = None if self.times is None else frame_step(self.times)
        return raised_events(
            output,
            ruled,
            weights=weights,
            judged=judged,
            pose=pose,
            evidence=self.evidence,
            response=self.system.response,
            step=step,
        )

    def _gain(self, row: int, region: GainRegion | None) -> FloatArray:
        own = self.gains.of([(self.system.emotions[row], region)], len(self.weights))[:, 0]
        return own * self.gains.system

    def _eased(self, raised: FloatArray) -> FloatArray:
        if self.system.ease == 0:
            return self.weights
        pairs = self.layout.antagonists
        return ease_antagonists(self.weights, raised, self.names, pairs, self.system.ease)


def _row_and_side(part: tuple[int, Side, GainRegion | None, FloatArray]) -> tuple[int, Side]:
    return part[:2]


def _driving(outputs: Outputs) -> dict[Side, FloatArray]:
    """Return the outputs that the blend shapes of each side follow.

    Those of neither half follow the smaller output: symmetric in left and right.
    """
    whole = outputs["both"]
    if len(outputs) > 1:
        whole = np.minimum(outputs["left"], outputs["right"])
    return {side: outputs.get(side, whole) if side != "both" else whole for side in SIDES}


def _alike(outputs: Outputs) -> FloatArray:
    """Return how far both halves of the face have an emotion, by the ratio of outputs: (F, E).

    1 where there are no outputs of the halves.
    """
    if len(outputs) == 1:
        return np.ones(outputs["both"].shape)
    left, right = outputs["left"], outputs["right"]
    share = np.minimum(left, right) / np.maximum(np.maximum(left, right), 1e-12)
    return linear_ramp(share, *_ALIKE)


def _shared(outputs: Outputs, alike: FloatArray) -> Outputs:
    """Return outputs whose halves follow the mean of the two as far as they are `alike` (F, E).

    So an emotion that the whole face shows peaks on both halves at once.
    """
    if len(outputs) == 1:
        return outputs
    left, right = outputs["left"], outputs["right"]
    towards = 0.5 * alike * (right - left)
    return {"both": outputs["both"], "left": left + towards, "right": right - towards}
