import numpy as np
import pytest

from usdface.cleanup.low_rank_model import (
    fit_low_rank_model,
    predict_from_others,
    reconstruct,
)

RNG = np.random.default_rng(3)
MODES = RNG.normal(size=(3, 12, 3))
STILL = RNG.normal(size=(400, 3)) @ MODES.reshape(3, -1)
STILL = STILL.reshape(400, 12, 3) + RNG.normal(size=(12, 3))
ALL = np.ones((400, 12), dtype=bool)


def test_what_has_few_modes_is_told_by_any_markers_that_determine_them() -> None:
    model, _ = fit_low_rank_model(STILL, ALL, STILL)
    np.testing.assert_allclose(reconstruct(model, STILL, ALL), STILL, atol=1e-3)
    seen = ALL.copy()
    seen[:, 4:] = False
    np.testing.assert_allclose(reconstruct(model, STILL, seen), STILL, atol=1e-2)


def test_a_marker_has_no_say_in_its_own_prediction() -> None:
    model, _ = fit_low_rank_model(STILL, ALL, STILL)
    without = ALL.copy()
    without[:, 7] = False
    expected = reconstruct(model, STILL, without)[:, 7]
    np.testing.assert_allclose(predict_from_others(model, STILL, ALL)[:, 7], expected, atol=1e-9)
    off = STILL.copy()
    off[:, 7] += 100.0
    np.testing.assert_allclose(predict_from_others(model, off, ALL)[:, 7], expected, atol=1e-6)


def test_the_model_is_learned_from_what_is_seen() -> None:
    """A tenth of all entries hidden, each frame in a pattern of its own."""
    seen = np.random.default_rng(4).random(ALL.shape) > 0.1
    guess = np.broadcast_to(STILL.mean(axis=0), STILL.shape)
    hidden = np.where(seen[..., None], STILL, np.nan)
    _, filled = fit_low_rank_model(hidden, seen, guess)
    np.testing.assert_array_equal(filled[seen], STILL[seen])
    error = np.linalg.norm(filled - STILL, axis=2)[~seen]
    assert np.sqrt(np.mean(error**2)) < 0.02 * STILL.std()


@pytest.mark.parametrize("frames", [1, 2, 16])
def test_few_frames_predict_their_mean_or_better(frames: int) -> None:
    few, seen = STILL[:frames], ALL[:frames]
    model, _ = fit_low_rank_model(few, seen, few)
    off = np.linalg.norm(reconstruct(model, few, seen) - few)
    assert off <= np.linalg.norm(few - few.mean(axis=0)) + 1e-9
