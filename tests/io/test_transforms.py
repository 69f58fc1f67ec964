import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from usdface.errors import InputError
from usdface.io.transforms import along, compose, decompose, followed_by

HALF = np.sqrt(0.5)


def test_scale_then_rotation_then_translation() -> None:
    # A quarter turn about z takes x to y.
    matrix = compose(np.array([10.0, 0, 0]), np.array([0, 0, HALF, HALF]), np.array([2.0, 3, 4]))
    np.testing.assert_allclose([1, 0, 0, 1] @ matrix, [10, 2, 0, 1], atol=1e-15)
    np.testing.assert_allclose([0, 1, 0, 1] @ matrix, [7, 0, 0, 1], atol=1e-15)


def test_decompose_undoes_compose() -> None:
    rng = np.random.default_rng(3)
    for _ in range(50):
        translation, rotation = rng.normal(size=3), rng.normal(size=4)
        rotation *= np.sign(rotation[3]) / np.linalg.norm(rotation)
        scale = rng.uniform(0.1, 3, 3) * (rng.choice([1, -1]), 1, 1)
        back = decompose(compose(translation, rotation, scale))
        np.testing.assert_allclose(
            np.concatenate(back), [*translation, *rotation, *scale], atol=1e-12
        )


def test_decompose_of_a_flattened_transform() -> None:
    translation, rotation, scale = decompose(np.diag([2.0, 0, 1, 1]))
    np.testing.assert_array_equal(compose(translation, rotation, scale), np.diag([2.0, 0, 1, 1]))


def test_many_at_once_are_as_one_by_one() -> None:
    rng = np.random.default_rng(4)
    moves, turns, sizes = (
        rng.normal(size=(5, 2, 3)),
        rng.normal(size=(5, 2, 4)),
        rng.random((5, 2, 3)),
    )
    matrices = compose(moves, turns, sizes)
    np.testing.assert_allclose(matrices[3, 1], compose(moves[3, 1], turns[3, 1], sizes[3, 1]))
    for one, many in zip(decompose(matrices[2, 0]), decompose(matrices), strict=True):
        np.testing.assert_allclose(one, many[2, 0])


def test_the_zero_quaternion_is_refused() -> None:
    with pytest.raises(InputError):
        compose(np.zeros((2, 3)), np.array([[0, 0, 0, 1.0], [0, 0, 0, 0]]), np.ones((2, 3)))


@pytest.mark.parametrize("stretch", [(2.0, 2.0, 2.0), (2.0, 2.0, -2.0)])
def test_followed_by_what_keeps_angles_is_the_product(stretch: tuple[float, ...]) -> None:
    rng = np.random.default_rng(5)
    moves, turns, sizes = rng.normal(size=(6, 3)), rng.normal(size=(6, 4)), np.full((6, 3), 1.5)
    then = compose(rng.normal(size=3), rng.normal(size=4), np.array(stretch))
    expected = compose(moves, turns, sizes) @ then
    np.testing.assert_allclose(
        compose(*followed_by(moves, turns, sizes, then)), expected, atol=1e-9
    )


def test_rotations_go_the_shortest_way_at_constant_speed() -> None:
    rng = np.random.default_rng(6)
    keys = rng.normal(size=(8, 4))
    keys /= np.linalg.norm(keys, axis=1, keepdims=True)
    keys[3] = -keys[2]  # the same rotation
    times = np.sort(rng.uniform(0, 7, 200))
    place = times.astype(np.int64)
    judge = Slerp(np.arange(8), Rotation.from_quat(keys))(times)
    turned = Rotation.from_quat(along(keys, place, times - place))
    assert (turned.inv() * judge).magnitude().max() < 1e-7
