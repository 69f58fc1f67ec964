"""Raising: weak expressions are brought up to their poses, one event at a time.

In an event (`usdface.correction.events`) every blend shape is raised by the difference from its
mean at the peak to the pose, times its part in the expression (`usdface.correction.evidence`) and
the envelope of the event. So the correction rises, holds and falls with the performance, and a full
expression gets none. An event that the classifier alone detects is raised as far as its output
says, in the blend shapes that the markers determine: that evidence is thinner.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.correction.events import Events, events_of, frame_events
from usdface.correction.evidence import Evidence
from usdface.correction.pose_blend import respond
from usdface.face.regions import GainRegion

__all__ = ["RaisedEvents", "raised_events"]

# A region matches an expression from this share of the evidence on, in the trace.
_MATCHED = 0.5
# Standard deviations of a weight at the peak that are left below 1, where the jitter of the weight
# would be clipped. Set by hand.
_HEADROOM = 1.5


@dataclass(frozen=True, eq=False, slots=True)
class RaisedEvents:
    """The events of an emotion, and how far the face matches its pose in each of their frames.

    Attributes
    ----------
    events : Events
    level : (N,) float64
        The share of the pose that is to be reached, by the output at the peak alone.
    mean : (N, T) float64
        Mean weights at the peak.
    most : (N, T) float64
        The largest weight that a blend shape is raised to: 1 less its jitter at the peak.
    regions : mapping of str to (N,) float64
        How far each region matches the expression, 0 to 1.
    participation : (N, T) float64
        How far each blend shape takes part, 0 to 1, and is raised; 0 where a region is missing.
    """

    events: Events
    level: FloatArray
    mean: FloatArray
    most: FloatArray
    regions: Mapping[GainRegion, FloatArray]
    participation: FloatArray

    def raise_part(
        self, part: FloatArray, gain: FloatArray, added: FloatArray, reached: FloatArray
    ) -> None:
        """Raise `added` to the additions of a part of the pose, and `reached` to its targets.

        Parameters
        ----------
        part : (T,) float64
        gain : (F,) float64
        added, reached : (F, T) float64
            Changed in place.
        """
        shapes = np.flatnonzero((part > 0) & self.participation.any(axis=0))
        frames, envelope = self.events.frames, self.events.envelope[:, None]
        target = (self.level * gain[frames])[:, None] * part[shapes]
        target = np.minimum(target, self.most[:, shapes])
        share = envelope * self.participation[:, shapes]
        block = np.ix_(frames, shapes)
        lacking = np.maximum(target - self.mean[:, shapes], 0.0)
        added[block] = np.maximum(added[block], share * lacking)
        reached[block] = np.maximum(reached[block], share * target)

    def intensity(self, gain: FloatArray) -> FloatArray:
        """Return the share of its pose that the emotion gets over a take, at gains (F,): (F,)."""
        intensity = np.zeros(len(gain))
        at = self.events.frames
        intensity[at] = (
            self.level * gain[at] * self.events.envelope * self.participation.max(axis=1)
        )
        return intensity

    def missing(self, region: GainRegion, frames: int) -> BoolArray:
        """Return the frames of a take in which a region does not match the emotion: (F,)."""
        missing = np.zeros(frames, dtype=bool)
        missing[self.events.frames] = self.regions[region] < _MATCHED
        return missing


def raised_events(
    output: FloatArray,
    by_rules: FloatArray,
    *,
    weights: FloatArray,
    judged: FloatArray,
    pose: FloatArray,
    evidence: Evidence,
    response: tuple[float, float],
    step: float | None,
) -> RaisedEvents:
    """Return the events of an emotion with their evidence.

    Parameters
    ----------
    output : (F,) float64
    by_rules : (F,) float64
        The output of the rules alone, without the classifier.
    weights : (F, T) float64
        Solved weights of the face, or of a half mirrored to the other side.
    judged : (F, T) float64
        The weights that are judged: `weights`, or a mixture of both halves of the face.
    pose : (T,) float64
    evidence : Evidence
    response : (onset, full)
    step : float [s] or None
        Time between the frames; None where each is an event of its own.
    """
    onset = response[0]
    events = frame_events(output, onset) if step is None else events_of(output, onset, step)
    ruled = np.minimum(by_rules, output)
    if step is not None:
        mean, jitter, confirmed = _at_peaks(events, output, ruled, weights)
        most = 1.0 - _HEADROOM * np.sqrt(jitter)
    else:
        mean, confirmed = events.peaks(weights), ruled[events.frames] / output[events.frames]
        most = np.ones(mean.shape)
    judged_mean = mean if judged is weights else events.peaks(judged)
    regions = evidence.match(judged_mean, pose)
    least_match = np.ones(len(mean))
    for match in regions.values():
        least_match = np.minimum(least_match, match)
    participation = evidence.participation(judged_mean, pose, events.size, confirmed)
    participation = participation * least_match[:, None]
    level = np.maximum(
        respond(confirmed * events.size, response),
        np.minimum(respond(events.size, response), events.size),
    )
    return RaisedEvents(events, level, mean, most, regions, participation)


def _at_peaks(
    events: Events, output: FloatArray, ruled: FloatArray, weights: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return mean and variance of each weight (F, T) at the peak of each frame's event: (N, T).

    And the share (N,) of the output there that is `ruled` (F,), of the rules, not of the
    classifier. The variance excludes the part that is linear in the output: that is the
    performance.
    """
    column = output[:, None]
    moments = [weights, weights**2, column * weights, column, column**2, ruled[:, None]]
    # Together, as each call goes through all events.
    mean, square, product, output_mean, output_square, ruled_mean = np.split(
        events.peaks(np.concatenate(moments, axis=1)),
        np.cumsum([each.shape[1] for each in moments[:-1]]),
        axis=1,
    )
    output_variance = output_square - output_mean**2
    shared = (product - mean * output_mean) ** 2 / np.maximum(output_variance, 1e-12)
    jitter = np.maximum(square - mean**2 - shared, 0.0)
    return mean, np.asarray(jitter), np.asarray(ruled_mean / output_mean)[:, 0]
