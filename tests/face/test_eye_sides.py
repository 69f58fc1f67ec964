import numpy as np
import pytest

from usdface.arrays import FloatArray, IntArray
from usdface.face.eye_sides import is_left_lid


def eyes(*centres: float, pairs: int = 7, width: float = 0.03) -> tuple[FloatArray, IntArray]:
    """Return a face (V, 3) 0.2 wide, its middle at 0, and the pairs (P, 2) of its eyes."""
    skin = np.linspace(-0.1, 0.1, 201)
    x = np.concatenate([centre + np.linspace(-width / 2, width / 2, pairs) for centre in centres])
    points = np.zeros((len(skin) + 2 * len(x), 3))
    points[:, 0] = np.concatenate([skin, np.repeat(x, 2)])
    return points, len(skin) + np.arange(2 * len(x)).reshape(-1, 2)


@pytest.mark.parametrize("pairs", [1, 2, 7])
def test_two_eyes_have_a_side_each(pairs: int) -> None:
    is_left = is_left_lid(*eyes(0.032, -0.032, pairs=pairs))
    assert is_left.tolist() == [True] * pairs + [False] * pairs


@pytest.mark.parametrize("centre", [0.032, -0.032])
def test_a_single_eye_is_not_split(centre: float) -> None:
    assert is_left_lid(*eyes(centre)).tolist() == [centre > 0] * 7


def test_two_eyes_on_one_side_of_the_mesh_are_two() -> None:
    """Beside a prop, or as a part of a scene."""
    assert is_left_lid(*eyes(0.09, 0.03)).tolist() == [True] * 7 + [False] * 7


def test_without_lids_there_are_no_sides() -> None:
    assert is_left_lid(np.zeros((3, 3)), np.zeros((0, 2), dtype=np.int64)).shape == (0,)
