"""Events: one size each, held where the performance is held, and continuous in the output."""

import tracemalloc

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from usdface.correction.events import events_of, frame_events

STEP = 1 / 60  # s
FAST = ((120, 240), (60, 480))  # Hz


def bump(size: float, hold: int = 60) -> np.ndarray:
    rise = np.linspace(0, size, 30)
    return np.concatenate([np.zeros(20), rise, np.full(hold, size), rise[::-1], np.zeros(20)])


def test_an_event_reaches_the_onset_and_ends_at_half_of_it():
    curve = np.concatenate([bump(0.19), bump(0.21), bump(0.9)])
    events = events_of(curve, 0.2, STEP)
    first, second = (events.frames < 320), (events.frames >= 320)
    np.testing.assert_allclose(events.size[first], 0.21)
    np.testing.assert_allclose(events.size[second], 0.9)
    assert events.frames.min() > 160
    assert curve[events.frames].min() > 0.1 >= np.delete(curve[160:], events.frames - 160).max()


def test_flicker_around_the_onset_is_one_event():
    events = events_of(bump(0.2) + 0.03 * np.sin(np.arange(160)), 0.2, STEP)
    assert (np.diff(events.frames) == 1).all()
    held = events.size[(events.frames >= 50) & (events.frames < 110)]
    assert np.ptp(held) < 0.02


def test_a_held_pose_is_held_and_its_ends_are_monotone():
    jitter = 0.01 * np.random.default_rng(0).standard_normal(160)
    events = events_of(bump(0.5) + jitter, 0.15, STEP)
    inside = slice(50 - events.frames[0], 110 - events.frames[0])
    assert (events.envelope[inside] == 1).all()
    assert np.diff(events.envelope[: inside.start]).min() >= 0
    assert np.diff(events.envelope[inside.stop :]).max() <= 0
    means = events.peaks(np.arange(160.0)[:, None])
    assert np.ptp(means[inside]) == 0 and means[inside.start] == pytest.approx(79.5, abs=1)


def test_a_dip_is_a_dip():
    dip = np.concatenate([np.linspace(0.8, 0.2, 30), np.linspace(0.2, 0.8, 30)])
    curve = np.concatenate([bump(0.8)[:110], dip, bump(0.8)[50:]])
    events = events_of(curve, 0.15, STEP)
    assert events.envelope[110:140].min() < 0.5


@pytest.mark.parametrize("dip", [0.0, 0.05, 0.0999, 0.1001, 0.15, 0.1999, 0.2001, 0.25])
def test_two_events_become_one_as_the_dip_between_them_rises(dip):
    def sizes(depth: float) -> np.ndarray:
        curve = np.concatenate([bump(0.9)[:-25], np.full(10, depth), bump(0.3)[25:]])
        events = events_of(np.maximum(curve, depth), 0.2, STEP)
        return np.interp(np.arange(len(curve)), events.frames, events.size)

    low = sizes(dip)[200]
    assert (0.3 if dip < 0.1 else 0.9 if dip > 0.2 else 0.3) <= low + 1e-9
    assert abs(sizes(dip + 2e-4)[200] - low) < 0.01


def test_events_are_a_continuous_function_of_the_output():
    rng, worst = np.random.default_rng(0), 0.0
    for _ in range(60):
        curve = gaussian_filter1d(rng.standard_normal(300), 8) * rng.uniform(0.4, 1.8)
        moved = gaussian_filter1d(rng.standard_normal(300), 3)
        weights = rng.uniform(size=(300, 1))
        found = []
        for output in (curve, curve + 1e-5 * moved / np.abs(moved).max()):
            events = events_of(np.clip(output, 0, 1), 0.15, STEP)
            reached = np.clip((events.size - 0.15) / 0.25, 0, 1) * events.envelope
            over_take = np.zeros((300, 2))
            over_take[events.frames, 0] = reached
            over_take[events.frames, 1:] = reached[:, None] * events.peaks(weights)
            found.append(over_take)
        worst = max(worst, np.abs(found[1] - found[0]).max())
    assert worst < 2e-3


def test_nothing_is_no_event():
    assert not len(events_of(np.zeros(5), 0.15, STEP).frames)
    assert not len(frame_events(np.zeros(5), 0.15).frames)
    assert events_of(np.zeros(5), 0.15, STEP).peaks(np.zeros((5, 3))).shape == (0, 3)


def test_frames_on_their_own_are_events_on_their_own():
    found = frame_events(np.array([0.1, 0.5, 0.15, 0.3]), 0.15)
    assert found.frames.tolist() == [1, 3] and found.size.tolist() == [0.5, 0.3]


def coming_and_going(frames: int) -> np.ndarray:
    """Return an output that crosses the onset 0.15 every 24 frames and never ends: (F,)."""
    return 0.15 + 0.05 * np.sin(2 * np.pi * np.arange(frames) / 48)


def by_pairs(output: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the sizes and peaks of one stretch by comparing all pairs of its frames."""
    onset, release = 0.15, 0.075
    count = len(output)
    least = np.empty((count, count))
    for i in range(count):
        least[i, i:] = np.minimum.accumulate(output[i:])
        least[i, : i + 1] = np.minimum.accumulate(output[i::-1])[::-1]
    own = np.minimum(output, onset)[:, None]
    least = np.minimum(least, onset)
    fallen = (onset - least) / (onset - release)
    inner = output >= onset
    together = (1 - fallen * np.maximum(own - least, 0) / (own - release))[:, inner]
    size = (together * output[inner]).max(axis=1)
    weights = together * np.clip((output[inner] / size[:, None] - 0.8) / 0.1, 0, 1)
    return size, weights @ values[inner] / weights.sum(axis=1, keepdims=True)


@pytest.mark.parametrize("smoothing", [0.3, 2, 8])
def test_sizes_and_peaks_are_those_of_all_pairs_of_frames(smoothing: float):
    rng = np.random.default_rng(3)
    for _ in range(4):
        noise = gaussian_filter1d(rng.standard_normal(700), smoothing)
        output = np.maximum(0.15 + 0.05 * noise / noise.std(), 0.0751)
        values = rng.random((700, 3))
        events = events_of(output, 0.15, STEP)
        size, peaks = by_pairs(output, values)
        np.testing.assert_allclose(events.size, size, rtol=0, atol=1e-12)
        np.testing.assert_allclose(events.peaks(values), peaks, rtol=0, atol=1e-12)


def test_the_memory_of_an_emotion_that_lasts_is_a_few_numbers_a_frame():
    taken = []
    for frames in (9_000, 18_000):
        output, values = coming_and_going(frames), np.ones((frames, 1))
        tracemalloc.start()
        try:
            events_of(output, 0.15, STEP).peaks(values)
            taken.append(tracemalloc.get_traced_memory()[1])
        finally:
            tracemalloc.stop()
    # By frames and cores, the shorter one took 25 MB and the longer four times as much.
    assert taken[0] < 7.5e6 and taken[1] < 2.2 * taken[0]


def test_a_peak_far_behind_in_an_emotion_that_lasts_fades_out_smoothly():
    output = coming_and_going(18_000)
    higher = output.copy()
    higher[12] = 0.9
    near, far = (events_of(curve, 0.15, STEP) for curve in (output, higher))
    # Of all cores but that of the peak itself.
    more = (far.size - near.size)[output >= 0.15][40:]
    assert np.ptp(more[:1700]) < 1e-9 and more[0] > 0.2
    assert np.diff(more).max() < 1e-9 and np.diff(more).min() > -0.02
    assert (more[-4000:] == 0).all()


@pytest.mark.parametrize(
    "rates", [(30, 120), *(pytest.param(rates, marks=pytest.mark.slow) for rates in FAST)]
)
def test_an_emotion_that_lasts_is_alike_at_any_frame_rate(rates: tuple[int, int]) -> None:
    found, peaks = [], []
    for rate in rates:
        times = np.arange(100 * rate) / rate
        output = 0.15 + 0.05 * np.sin(2 * np.pi * times / 0.8)
        output[(times > 0.1) & (times < 0.3)] = 0.9
        events = events_of(output, 0.15, 1 / rate)
        found.append(np.interp(np.arange(1, 99), times[events.frames], events.size))
        means = events.peaks(np.stack([times / 100, np.sin(times / 9)], axis=1))
        peaks.append([np.interp(np.arange(1, 99), times[events.frames], m) for m in means.T])
    np.testing.assert_allclose(*peaks, atol=0.01)
    assert found[0].max() > 0.35 and found[0].min() < 0.25
    np.testing.assert_allclose(*found, atol=0.02)


@pytest.mark.parametrize("output", [[0.3, 1.0], [0.3, 1.0, 0.3, 0.3], [0.5, 1.0, 0.5]])
def test_an_event_that_is_high_for_one_frame_of_240_hz_has_a_peak(output: list[float]) -> None:
    values = np.full((len(output), 1), 0.4)
    peaks = events_of(np.array(output), 0.2, 1 / 240).peaks(values)
    np.testing.assert_allclose(peaks, values)


def test_a_single_frame_is_an_event() -> None:
    events = events_of(np.array([0.9]), 0.15, 0.0)
    np.testing.assert_array_equal(events.frames, [0])
    np.testing.assert_allclose(events.size, 0.9)
    np.testing.assert_allclose(events.peaks(np.array([[0.3]])), 0.3)
