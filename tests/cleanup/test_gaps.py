import numpy as np
import pytest

from usdface.cleanup.gaps import fill_gaps

TIMES = np.arange(240) / 60
WAVE = np.stack([np.sin(3 * TIMES), np.cos(2 * TIMES), np.sin(TIMES)], -1)[:, None] * 0.01
KNOWN = np.ones(240, dtype=bool)


def hidden(first: int, last: int) -> np.ndarray:
    seen = np.ones((240, 1), dtype=bool)
    seen[first : last + 1] = False
    return seen


def test_a_short_gap_is_bridged_by_the_markers_own_motion() -> None:
    """What the others say is no use here; a cubic through the ends is off by 1e-7 m."""
    seen = hidden(100, 105)
    named = np.random.default_rng(2).normal(size=WAVE.shape) * 1e-4
    filled = fill_gaps(WAVE, seen, named, known=KNOWN, times=TIMES, noise=0.0)
    assert np.abs(filled - WAVE).max() < 1e-5


def test_a_long_gap_follows_the_others_and_meets_its_ends() -> None:
    """They have the motion, but sit elsewhere, drifting: exact but for the drift."""
    seen = hidden(60, 180)
    named = WAVE + [0.02, -0.01, 0.005] + 1e-3 * TIMES[:, None, None]
    filled = fill_gaps(
        np.where(seen[..., None], WAVE, np.nan), seen, named, known=KNOWN, times=TIMES, noise=0.0
    )
    assert np.abs(filled - WAVE).max() < 1e-4


@pytest.mark.parametrize(("first", "last"), [(0, 80), (160, 239)])
def test_a_gap_at_the_end_of_a_take_follows_the_others(first: int, last: int) -> None:
    seen = hidden(first, last)
    filled = fill_gaps(
        np.where(seen[..., None], WAVE, np.nan),
        seen,
        WAVE + 0.01,
        known=KNOWN,
        times=TIMES,
        noise=0.0,
    )
    assert np.abs(filled - WAVE).max() < 1e-3


def test_noise_at_the_ends_is_not_carried_into_the_gap() -> None:
    """A cubic through both ends swings by far more than the noise."""
    seen, noise = hidden(100, 130), 5e-4
    worst = []
    for seed in range(10):
        noisy = WAVE + noise * np.random.default_rng(seed).normal(size=WAVE.shape)
        filled = fill_gaps(noisy, seen, noisy, known=KNOWN & seen[:, 0], times=TIMES, noise=noise)
        worst.append(np.abs(filled - WAVE)[~seen].max())
    assert np.median(worst) < 0.003


def test_what_was_seen_stays() -> None:
    seen = hidden(50, 60)
    filled = fill_gaps(WAVE, seen, WAVE, known=KNOWN, times=TIMES, noise=1e-3)
    np.testing.assert_array_equal(filled[seen], WAVE[seen])
