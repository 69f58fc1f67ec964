import numpy as np
import pytest

from usdface.fuzzy.norms import (
    AGGREGATIONS,
    HEDGES,
    S_NORMS,
    T_NORMS,
    most_of,
    most_weights,
)

GRID = np.linspace(0, 1, 21)
A, B, C = np.meshgrid(GRID, GRID, GRID, indexing="ij")
ONE, ZERO = np.ones_like(A), np.zeros_like(A)


@pytest.mark.parametrize("name", T_NORMS)
def test_a_t_norm_keeps_its_laws(name):
    t = T_NORMS[name]
    np.testing.assert_allclose(t(A, ONE), A, atol=1e-15)
    np.testing.assert_array_equal(t(A, ZERO), ZERO)
    np.testing.assert_array_equal(t(A, B), t(B, A))
    assert (np.diff(t(A, B), axis=0) >= -1e-15).all()
    if name != "nilpotent":  # it jumps where a + b = 1, which sums of decimals miss
        np.testing.assert_allclose(t(t(A, B), C), t(A, t(B, C)), atol=1e-12)


@pytest.mark.parametrize(("s", "t"), list(zip(S_NORMS, T_NORMS, strict=True)))
def test_each_s_norm_is_the_dual_of_its_t_norm(s, t):
    quarters = np.linspace(0, 1, 5)  # exact in binary
    a, b = np.meshgrid(quarters, quarters)
    np.testing.assert_allclose(S_NORMS[s](a, b), 1 - T_NORMS[t](1 - a, 1 - b), atol=1e-15)


def test_known_values():
    a, b = np.array([0.5]), np.array([0.75])
    found = {name: norm(a, b)[0] for name, norm in T_NORMS.items()}
    assert found == pytest.approx(
        {
            "min": 0.5,
            "prod": 0.375,
            "lukasiewicz": 0.25,
            "hamacher": 0.375 / 0.875,
            "einstein": 0.375 / 1.125,
            "drastic": 0,
            "nilpotent": 0.5,
        }
    )
    assert AGGREGATIONS["sum"](a, b)[0] == 1.25


def test_hedges():
    x = np.array([0.0, 0.25, 0.5, 0.81, 1.0])
    expected = {
        "not": [1, 0.75, 0.5, 0.19, 0],
        "very": [0, 0.0625, 0.25, 0.6561, 1],
        "somewhat": [0, 0.5, np.sqrt(0.5), 0.9, 1],
        "extremely": [0, 0.125, 0.5, 1 - 2 * 0.19**2, 1],
        "seldom": [0, np.sqrt(0.125), 0.5, 1 - np.sqrt(0.095), 1],
    }
    assert expected.keys() == HEDGES.keys()
    for name, values in expected.items():
        np.testing.assert_allclose(HEDGES[name](x), values, atol=1e-15)
    np.testing.assert_allclose(HEDGES["seldom"](HEDGES["extremely"](x)), x, atol=1e-12)


@pytest.mark.parametrize("name", S_NORMS)
def test_no_s_norm_exceeds_1_by_rounding(name):
    a, b = np.random.default_rng(0).uniform(0, 1, (2, 100_000)) ** 0.1
    joined = S_NORMS[name](a, b)
    assert joined.max() <= 1 and joined.min() >= 0


def test_most_of_is_an_ordered_weighted_average():
    for count in range(1, 9):
        assert most_weights(count).sum() == pytest.approx(1)
        alike = [np.full(3, 0.37)] * count
        np.testing.assert_allclose(most_of(alike), 0.37, atol=1e-12)
    one, none = np.ones(1), np.zeros(1)
    assert most_of([one] * 4 + [none])[0] == pytest.approx(1)  # one of five may be wrong
    assert most_of([one] * 2 + [none] * 3)[0] == pytest.approx(0)
    assert most_of([one] * 3 + [none] * 2)[0] == pytest.approx(0.5)


def test_most_of_rises_with_each_degree_and_knows_no_order():
    rng = np.random.default_rng(0)
    degrees = rng.uniform(size=(6, 200))
    found = most_of(list(degrees))
    np.testing.assert_array_equal(found, most_of(list(degrees[::-1])))
    assert (most_of(list(np.minimum(degrees + 0.1, 1))) >= found).all()
    assert (degrees.min(axis=0) <= found + 1e-12).all() and (
        found <= degrees.max(axis=0) + 1e-12
    ).all()
