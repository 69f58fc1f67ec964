"""Blending in and out: smooth, and limits are never exceeded."""

import numpy as np
import pytest

from usdface.correction.temporal_blend import blend_frames, blend_out, blended

RNG = np.random.default_rng(12)
FRAMES = 12


def roughness(curve: np.ndarray) -> float:
    return float(np.sqrt((np.diff(curve, 2, axis=0) ** 2).mean()))


@pytest.fixture
def noisy() -> tuple[np.ndarray, np.ndarray]:
    """Return jittering weights (200, 3), and raised to a pose that one of them does not have."""
    weights = 0.3 + 0.02 * RNG.standard_normal((200, 3))
    drive = np.clip(np.minimum(np.arange(200) - 60, 140 - np.arange(200)) / 20, 0, 1)
    return weights, np.maximum(weights, drive[:, None] * [0.8, 1.0, 0.0])


def test_a_blend_time_is_counted_in_frames():
    assert blend_frames(np.arange(10) / 60, 0.2) == 12
    assert blend_frames(np.arange(10) / 24, 0.2) == 5
    assert blend_frames(np.arange(10) / 24, 0.0) == 0
    assert blend_frames(np.zeros(1), 0.1) == 0  # one frame has no time before or after


def test_no_frames_change_nothing(noisy):
    weights, raised = noisy
    np.testing.assert_array_equal(blended(raised - weights, 1, None), raised - weights)
    np.testing.assert_allclose(blend_out(weights, raised, weights, 0, None), weights, atol=1e-15)


def test_what_rises_holds_and_falls_still_does():
    added = np.clip(np.minimum(np.arange(200) - 60, 140 - np.arange(200)) / 5, 0, 1)[:, None]
    smooth = blended(added, FRAMES, None)
    middle = np.flatnonzero(added[:, 0] == 1)[FRAMES // 2 : -(FRAMES // 2)]
    np.testing.assert_allclose(smooth[middle], 1.0, atol=1e-12)
    rising = np.diff(smooth[: middle[0], 0])
    assert rising.min() > -1e-12 and rising.max() < 0.7 * np.diff(added[:, 0]).max()
    assert np.diff(smooth[middle[-1] :, 0]).max() < 1e-12


def test_it_begins_and_ends_within_half_the_blend_time():
    added = np.zeros((60, 2))
    added[30, 0] = 1.0
    smooth = blended(added, FRAMES, None)
    assert smooth[30 - FRAMES // 2 : 31 + FRAMES // 2, 0].min() > 0
    assert not smooth[: 30 - FRAMES // 2].any() and not smooth[31 + FRAMES // 2 :].any()
    assert not smooth[:, 1].any()


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_what_is_taken_back_is_never_less_than_must_be(sign):
    weights = 0.5 + 0.1 * RNG.standard_normal((100, 2))
    corrected = weights + sign * RNG.uniform(size=(100, 2))
    share = np.where((np.arange(100) > 40) & (np.arange(100) < 60), 0.3, 1.0)[:, None]
    held = weights + share * (corrected - weights)
    kept = (blend_out(weights, corrected, held, FRAMES, None) - weights) * sign
    assert (kept >= 0).all() and (kept <= (held - weights) * sign + 1e-12).all()
    far = np.r_[0:28, 73:100]
    np.testing.assert_array_equal(
        blend_out(weights, corrected, held, FRAMES, None)[far], corrected[far]
    )


def test_frames_on_either_side_of_a_gap_are_no_neighbours() -> None:
    """A pose that is held after a gap is held from its first frame on; dropped frames are none."""
    added = np.repeat([0.0, 1.0], 60)[:, None]
    times = np.arange(120) / 60.0
    gap = times + np.repeat([0.0, 1.0], 60)
    np.testing.assert_array_equal(blended(added, FRAMES, gap), added)
    smooth = blended(added, FRAMES, times)
    assert 0.0 < smooth[59, 0] < smooth[60, 0] < 1.0
    dropped = np.delete(np.arange(120), np.arange(3, 120, 4))
    assert 0.0 < blended(added[dropped], FRAMES, times[dropped])[45, 0] < 1.0
