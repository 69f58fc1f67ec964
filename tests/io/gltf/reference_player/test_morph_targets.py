import numpy as np

from usdface.io.gltf.reference_player.morph_targets import PlayerTargets

RNG = np.random.default_rng(4)


def scattered(count: int, vertices: int) -> np.ndarray:
    values = RNG.normal(size=(count, vertices, 3)).astype(np.float32)
    values[RNG.random((count, vertices)) < 0.7] = 0
    return values


def test_what_is_kept_is_what_was_given() -> None:
    values = scattered(5, 40)
    values[3] = 0
    kept = PlayerTargets.of(values)
    np.testing.assert_array_equal(kept.offsets().summed(np.eye(5)), values)
    assert sum(len(target.places) for target in kept.targets) == values.any(axis=2).sum()


def test_targets_add_up_by_their_weights() -> None:
    values, weights = scattered(5, 40), RNG.normal(size=(7, 5))
    weights[:, 2] = 0
    expected = np.tensordot(weights, values.astype(np.float64), 1)
    np.testing.assert_allclose(PlayerTargets.of(values).added(weights), expected, atol=1e-12)
    assert not PlayerTargets.of(values).added(np.zeros((2, 5))).any()
    assert PlayerTargets.of(values[:0]).added(np.zeros((2, 0))).shape == (2, 40, 3)


def test_meshes_side_by_side() -> None:
    one, other = scattered(3, 8), scattered(2, 5)
    joined = PlayerTargets.side_by_side([PlayerTargets.of(one), PlayerTargets.of(other)], 3)
    missing = np.zeros((1, 5, 3))
    expected = np.concatenate([one, np.concatenate([other, missing])], 1)
    np.testing.assert_array_equal(joined.offsets().summed(np.eye(3)), expected)


def test_offsets_are_placed_by_one_matrix_or_each_vertex_by_its_own() -> None:
    values, matrix = scattered(5, 40), RNG.normal(size=(3, 3))
    expected = values @ matrix.T
    for matrices in (matrix, np.tile(matrix, (40, 1, 1))):
        placed = PlayerTargets.of(values).offsets(matrices).summed(np.eye(5))
        np.testing.assert_allclose(placed, expected, atol=1e-5)
