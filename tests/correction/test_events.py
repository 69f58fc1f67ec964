"""Events: one size each, held where the performance is held."""

import numpy as np

from usdface.correction.events import events_of, frame_events


def bump(size: float, hold: int = 60) -> np.ndarray:
    rise = np.linspace(0, size, 30)
    return np.concatenate([np.zeros(20), rise, np.full(hold, size), rise[::-1], np.zeros(20)])


def test_an_event_reaches_the_onset_and_ends_at_half_of_it():
    curve = np.concatenate([bump(0.19), bump(0.21), bump(0.9)])
    first, second = events_of(curve, 0.2)
    assert (first.size, second.size) == (0.21, 0.9)
    for event in (first, second):
        assert curve[event.frames].min() > 0.1
        assert curve[event.frames.start - 1] <= 0.1 >= curve[event.frames.stop]


def test_flicker_around_the_onset_is_one_event():
    curve = bump(0.2) + 0.03 * np.sin(np.arange(160))
    assert len(events_of(curve, 0.2)) == 1


def test_a_held_pose_is_held_and_its_ends_are_monotone():
    jitter = 0.01 * np.random.default_rng(0).standard_normal(160)
    (event,) = events_of(bump(0.5) + jitter, 0.15)
    inside = slice(50 - event.frames.start, 110 - event.frames.start)
    assert (event.envelope[inside] == 1).all()
    assert np.diff(event.envelope[: inside.start]).min() >= 0
    assert np.diff(event.envelope[inside.stop :]).max() <= 0
    assert event.peak[inside].all() and not event.peak[0]


def test_a_dip_is_a_dip():
    dip = np.concatenate([np.linspace(0.8, 0.2, 30), np.linspace(0.2, 0.8, 30)])
    curve = np.concatenate([bump(0.8)[:110], dip, bump(0.8)[50:]])
    (event,) = events_of(curve, 0.15)
    assert event.envelope[110:140].min() < 0.5


def test_nothing_is_no_event():
    assert events_of(np.zeros(5), 0.15) == [] == frame_events(np.zeros(5), 0.15)


def test_frames_on_their_own_are_events_on_their_own():
    found = frame_events(np.array([0.1, 0.5, 0.15, 0.3]), 0.15)
    assert [(e.frames.start, e.size) for e in found] == [(1, 0.5), (3, 0.3)]
