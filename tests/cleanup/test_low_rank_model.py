import numpy as np
import pytest

from usdface.cleanup import low_rank_model
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


@pytest.mark.parametrize("gaps", [False, True])
@pytest.mark.parametrize("frames", [5, 60, 400])
def test_many_markers_are_modelled_alike_without_all_pairs(monkeypatch, frames: int, gaps) -> None:
    rng = np.random.default_rng(6)
    still = STILL[:frames] + 0.01 * rng.normal(size=(frames, 12, 3))
    seen = np.ones((frames, 12), dtype=bool)
    if gaps:
        seen[rng.random(seen.shape) < 0.1] = False
        seen[0] = True
    guess = np.broadcast_to(still.mean(axis=0), still.shape)
    dense, filled = fit_low_rank_model(still, seen, guess)
    monkeypatch.setattr(low_rank_model, "_MANY", 10)
    found, also = fit_low_rank_model(still, seen, guess)
    np.testing.assert_allclose(also, filled, atol=1e-9)
    np.testing.assert_allclose(found.powers, dense.powers, rtol=1e-9)
    assert found.variance == pytest.approx(dense.variance, rel=1e-9)
    modes, expected = (m.modes.reshape(len(m.modes), 36) for m in (found, dense))
    np.testing.assert_allclose(modes.T @ modes, expected.T @ expected, atol=1e-7)


def test_many_markers_that_rest_have_no_modes() -> None:
    still = np.repeat(np.random.default_rng(2).normal(size=(1, 1001, 3)), 20, axis=0)
    model, filled = fit_low_rank_model(still, np.ones((20, 1001), bool), still)
    np.testing.assert_array_equal(filled, still)
    np.testing.assert_allclose(model.mean, still[0], atol=1e-12)
