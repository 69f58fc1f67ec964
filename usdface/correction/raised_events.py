"""Raising: weak expressions are brought up to their poses, one event at a time.

In an event (`usdface.correction.events`) every blend shape that takes part in the expression
(`usdface.correction.evidence`) gets what its mean at the peak lacks of the pose, in each frame as
far as the expression is shown there. So the correction rises, holds and falls with the performance,
a whole expression gets none, and raising by the same outputs twice is doing it once.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.correction.events import Event, events_of, frame_events
from usdface.correction.evidence import Evidence
from usdface.correction.pose_blend import respond
from usdface.face.regions import GainRegion

__all__ = ["JudgedEvent", "frames_missing", "judged_events", "raise_part", "shown_shares"]


@dataclass(frozen=True, eq=False, slots=True)
class JudgedEvent:
    """An event of an emotion, and what the face shows of its pose.

    Attributes
    ----------
    event : Event
    level : float
        The share of the pose that it is to reach, by its size alone.
    mean : (T,) float64
        Mean weights at the peak.
    raised : (T,) bool
        Blend shapes that take part and are raised; none where a region is missing.
    missing : tuple of str
        Regions that do not show the expression.
    """

    event: Event
    level: float
    mean: FloatArray
    raised: BoolArray
    missing: tuple[GainRegion, ...]


def judged_events(
    output: FloatArray,
    weights: FloatArray,
    pose: FloatArray,
    evidence: Evidence,
    response: tuple[float, float],
    whole_take: bool,
) -> list[JudgedEvent]:
    """Return the events of an emotion with their evidence.

    Parameters
    ----------
    output : (F,) float64
    weights : (F, T) float64
        Solved weights of the face, or of a half mirrored to the other side.
    pose : (T,) float64
    evidence : Evidence
    response : (onset, full)
    whole_take : bool
        Whether frames follow one another; otherwise each is an event of its own.
    """
    events = (events_of if whole_take else frame_events)(output, response[0])
    found = []
    for event in events:
        mean = weights[event.frames][event.peak].mean(axis=0)
        missing = evidence.missing(mean, pose)
        taking = evidence.takes_part(mean, pose, event.size) & (not missing)
        level = float(respond(np.array(event.size), response))
        found.append(JudgedEvent(event, level, mean, taking, missing))
    return found


def raise_part(
    events: Sequence[JudgedEvent],
    weights: FloatArray,
    part: FloatArray,
    gain: FloatArray,
    added: FloatArray,
    reached: FloatArray,
) -> None:
    """Raise `added` to what the events add to a part of a pose, and `reached` to where they lead.

    Parameters
    ----------
    events : sequence of JudgedEvent
    weights : (F, T) float64
        Solved weights.
    part : (T,) float64
    gain : (F,) float64
    added, reached : (F, T) float64
        Changed in place.
    """
    for judged in events:
        shapes = np.flatnonzero(judged.raised & (part > 0))
        if not shapes.size:
            continue
        frames, envelope = judged.event.frames, judged.event.envelope[:, None]
        mean = weights[frames][judged.event.peak][:, shapes].mean(axis=0)
        target = np.minimum(judged.level * gain[frames, None] * part[shapes], 1.0)
        block = np.ix_(np.arange(frames.start, frames.stop), shapes)
        added[block] = np.maximum(added[block], envelope * np.maximum(target - mean, 0.0))
        reached[block] = np.maximum(reached[block], envelope * target)


def shown_shares(events: Sequence[JudgedEvent], gain: FloatArray) -> FloatArray:
    """Return the share of its pose that an emotion gets over a take, at gains (F,): (F,)."""
    shown = np.zeros(len(gain))
    for judged in events:
        if judged.raised.any():
            at = judged.event.frames
            shown[at] = judged.level * gain[at] * judged.event.envelope
    return shown


def frames_missing(events: Sequence[JudgedEvent], region: GainRegion, frames: int) -> BoolArray:
    """Return the frames of a take in which a region does not show an emotion: (F,)."""
    missing = np.zeros(frames, dtype=bool)
    for judged in events:
        missing[judged.event.frames] |= region in judged.missing
    return missing
