import numpy as np
import pytest

from usdface.arrays import FloatArray
from usdface.retarget.neutral_cost import NeutralCost

WINDOWS, SHAPES, SIZE = 40, 5, 24


def a_cost(shown: FloatArray, seed: int = 0, seen: int = WINDOWS) -> tuple[NeutralCost, FloatArray]:
    """Return the cost of a take with the weights (W, P) that it has, `shown` (P,) in its neutral.

    Windows from `seen` on rest at what the neutral shows.
    """
    rng = np.random.default_rng(seed)
    offsets = 12.0 * rng.normal(size=(SHAPES, SIZE))
    weights = rng.uniform(0, 1, (WINDOWS, SHAPES)) * (rng.random((WINDOWS, SHAPES)) < 0.4)
    weights[seen:] = shown
    shares = rng.uniform(0.5, 1.5, WINDOWS)
    return NeutralCost((weights - shown) @ offsets, offsets, shares / shares.sum()), weights


def by(shape: int, weight: float) -> FloatArray:
    return np.where(np.arange(SHAPES) == shape, weight, 0.0)


def test_the_weights_of_the_neutral_cost_least() -> None:
    shown = np.array([0.2, 0.0, 0.15, 0.0, 0.0])
    cost, _ = a_cost(shown)
    found = cost.minimised(np.zeros(SHAPES), np.full(SHAPES, 1.0), np.full(SHAPES, 0.5))
    np.testing.assert_allclose(found, shown, atol=0.02)
    assert cost.mean(found) < 0.5 * cost.mean(np.zeros(SHAPES))


def test_the_least_cost_is_the_same_from_every_start() -> None:
    cost, _ = a_cost(np.array([0.2, 0.1, 0.0, 0.0, 0.3]))
    starts = np.random.default_rng(1).uniform(0, 0.5, (3, SHAPES))
    found = [cost.minimised(s, np.full(SHAPES, 2.0), np.full(SHAPES, 0.5)) for s in starts]
    np.testing.assert_allclose(found[1:], found[:-1], atol=1e-5)


def test_a_mean_costs_no_more_than_the_mean_of_the_costs() -> None:
    """The cost is convex (S. Boyd, L. Vandenberghe, "Convex Optimization", 2004, 3.2.5)."""
    cost, _ = a_cost(np.zeros(SHAPES), seed=2)
    for a, b in np.random.default_rng(3).uniform(0, 0.5, (20, 2, SHAPES)):
        assert cost.mean((a + b) / 2) <= (cost.mean(a) + cost.mean(b)) / 2 + 1e-9


def test_the_cost_is_of_displacements_and_of_weights() -> None:
    cost, _ = a_cost(np.zeros(SHAPES), seed=5)
    neutral = by(2, 0.1)
    assert 0.0 < cost.unexplained(neutral) < cost.mean(neutral)
    still = NeutralCost(np.zeros_like(cost.moved), cost.offsets, cost.shares)
    assert still.unexplained(np.zeros(SHAPES)) == still.mean(np.zeros(SHAPES)) == 0.0
    # Offsets that no displacement resembles get no weight, and leave all of it.
    turned = np.linalg.qr(np.concatenate([cost.offsets, cost.moved]).T)[0].T[SHAPES : SHAPES + 2]
    apart = NeutralCost(np.repeat(3.0 * turned, WINDOWS // 2, 0), cost.offsets, cost.shares)
    assert apart.unexplained(np.zeros(SHAPES)) == pytest.approx(4.5, abs=1e-6)


def test_weights_that_may_not_be_stay_0() -> None:
    shown = np.array([0.2, 0.0, 0.15, 0.0, 0.0])
    cost, _ = a_cost(shown)
    largest = np.array([0.5, 0.5, 0.0, 0.5, 0.1])
    found = cost.minimised(np.full(SHAPES, 0.3), np.full(SHAPES, 1.0), largest)
    assert found[2] == 0.0 and found[4] <= 0.1 and found[0] == pytest.approx(0.2, abs=0.03)


@pytest.mark.parametrize("seen", [WINDOWS, WINDOWS // 2, WINDOWS // 4])
def test_a_weight_that_every_movement_leaves_is_needed_in_all(seen: int) -> None:
    """Rest in the other windows does not count, with errors or without."""
    shown = by(0, 0.25)
    cost, _ = a_cost(shown, seen=seen)
    moves = np.arange(WINDOWS) < seen
    left = np.where(moves[:, None], -shown @ cost.offsets, 0.0)
    exact = NeutralCost(20.0 * left, 20.0 * cost.offsets, cost.shares).needed_in(shown)
    assert exact[0] == pytest.approx(1.0, abs=0.01) and (exact[1:] == np.inf).all()
    errors = np.random.default_rng(4).normal(size=left.shape)
    noisy = NeutralCost(left + errors, cost.offsets, cost.shares).needed_in(shown)
    assert noisy[0] > 0.6


def test_a_movement_against_a_shape_is_needed_in_the_windows_that_make_it() -> None:
    cost, _ = a_cost(np.zeros(SHAPES))
    few = np.arange(WINDOWS) < 4
    against = np.where(few, -0.3, 0.0)[:, None] * cost.offsets[0]
    opposed = NeutralCost(cost.moved + against, cost.offsets, cost.shares)
    assert opposed.needed_in(by(0, 0.3))[0] < 0.2


def test_a_weight_that_no_window_needs_is_needed_in_none() -> None:
    cost, _ = a_cost(np.zeros(SHAPES))
    still = NeutralCost(np.zeros_like(cost.moved), cost.offsets, cost.shares)
    assert still.needed_in(by(1, 0.3))[1] == 0.0
