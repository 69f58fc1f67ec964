"""Blending in and out: smooth, never short of what is asked, and idempotent."""

import numpy as np
import pytest

from usdface.correction.temporal_blend import blend_frames, blend_in, blend_out

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
    np.testing.assert_allclose(blend_in(weights, raised, 0), raised, atol=1e-15)
    np.testing.assert_allclose(blend_out(weights, raised, weights, 0), weights, atol=1e-15)


def test_what_is_blended_in_is_never_less_than_what_is_asked(noisy):
    weights, raised = noisy
    blended = blend_in(weights, raised, FRAMES)
    assert (blended >= raised).all() and blended.max() <= 1.0
    np.testing.assert_array_equal(blended[:, 2], weights[:, 2])


def test_it_begins_and_ends_within_the_blend_time(noisy):
    weights, raised = noisy
    added = raised > weights
    near = np.array([added[max(f - FRAMES, 0) : f + FRAMES + 1].any(0) for f in range(200)])
    blended = blend_in(weights, raised, FRAMES)
    np.testing.assert_array_equal(blended[~near], weights[~near])


def test_blending_twice_is_blending_once(noisy):
    weights, raised = noisy
    pose = np.where(raised > weights, raised, 0.0)
    once = blend_in(weights, raised, FRAMES)
    np.testing.assert_array_equal(blend_in(once, np.maximum(once, pose), FRAMES), once)


def test_the_correction_holds_no_jitter_of_the_weights(noisy):
    weights, raised = (part[:, :1] for part in noisy)
    plain = roughness(raised - weights)
    smooth = roughness(blend_in(weights, raised, FRAMES) - weights)
    assert plain > 0.4 * roughness(weights) > 4 * smooth


@pytest.mark.parametrize("late", [0, 5, 10, 15])
def test_what_comes_and_goes_evenly_is_hardly_overshot(late):
    """What is added is most while the weight is still on its way: it must not add up."""
    drive = np.clip(np.minimum(np.arange(200) - 60, 140 - np.arange(200)) / 20, 0, 1)[:, None]
    weights = 0.4 * np.roll(drive, late, axis=0)
    blended = blend_in(weights, np.maximum(weights, 0.8 * drive), FRAMES)
    assert 0.8 <= blended.max() < 0.825


def test_a_drive_that_flickers_leads_no_further_than_the_pose():
    weights, raised = np.zeros((200, 1)), np.zeros((200, 1))
    raised[60:140] = 0.6 * RNG.uniform(0.3, 1.0, (80, 1))
    raised[[70, 100, 130]] = 0.6
    blended = blend_in(weights, raised, FRAMES)
    assert (blended >= raised).all() and blended.max() <= 0.6 + 1e-12


def test_a_step_comes_gently():
    weights, raised = np.zeros((60, 1)), np.zeros((60, 1))
    raised[30:40] = 1.0
    blended = blend_in(weights, raised, FRAMES)
    assert np.abs(np.diff(blended, axis=0)).max() < 0.2
    np.testing.assert_allclose(blended[10:60], blended[59:9:-1], atol=1e-12)  # as it came
    assert (blended[30:40] == 1.0).all() and (blended[:18] == 0).all() and (blended[52:] == 0).all()


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_what_is_taken_back_is_never_less_than_must_be(sign):
    weights = 0.5 + 0.1 * RNG.standard_normal((100, 2))
    corrected = weights + sign * RNG.uniform(size=(100, 2))
    share = np.where((np.arange(100) > 40) & (np.arange(100) < 60), 0.3, 1.0)[:, None]
    held = weights + share * (corrected - weights)
    kept = (blend_out(weights, corrected, held, FRAMES) - weights) * sign
    assert (kept >= 0).all() and (kept <= (held - weights) * sign + 1e-12).all()
    far = np.r_[0:28, 73:100]
    np.testing.assert_array_equal(blend_out(weights, corrected, held, FRAMES)[far], corrected[far])
