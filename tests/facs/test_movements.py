import numpy as np
import pytest

from usdface.face.facs_names import UNITS
from usdface.facs.movements import CENTRAL, MOVEMENTS, POINTS, SIDED, prototype

PAIRED = [name for name, movement in MOVEMENTS.items() if movement.paired]
SIGN = np.array([-1.0, 1.0, 1.0])
OTHER = {"61": "62", "62": "61"}


def mirrored(ways: np.ndarray) -> np.ndarray:
    half = len(SIDED)
    return np.concatenate([ways[half : 2 * half], ways[:half], ways[2 * half :]]) * SIGN


def test_every_point_of_the_table_is_a_feature_point() -> None:
    for movement in MOVEMENTS.values():
        assert movement.ways.keys() <= {*SIDED, *CENTRAL}, movement.name
        assert all(any(way) for way in movement.ways.values()), movement.name


def test_the_longest_way_is_about_1() -> None:
    """So that an amount is the way of the farthest point."""
    for movement in MOVEMENTS.values():
        longest = max(np.linalg.norm(way) for way in movement.ways.values())
        assert 0.85 < longest < 1.6, movement.name


def test_units_have_their_titles_of_facs() -> None:
    named = {name for name in MOVEMENTS if name.isdigit() and int(name) in UNITS}
    assert len(named) > 20
    for name in named - {"61", "62", "63", "64"}:
        assert MOVEMENTS[name].title == UNITS[int(name)]


@pytest.mark.parametrize("name", PAIRED)
def test_the_right_half_is_the_mirror_image_of_the_left(name: str) -> None:
    left = prototype(MOVEMENTS[name], "L")
    right = prototype(MOVEMENTS[OTHER.get(name, name)], "R")
    assert np.array_equal(mirrored(left), right)


@pytest.mark.parametrize("name", PAIRED)
def test_both_halves_move_where_one_does(name: str) -> None:
    movement = MOVEMENTS[name]
    both, left, right = (prototype(movement, side) for side in ("", "L", "R"))
    sided = 2 * len(SIDED)
    assert np.array_equal(both[:sided], (left + right)[:sided])
    assert np.array_equal(both[sided:], left[sided:])


def test_the_jaw_goes_to_the_character_s_left() -> None:
    ways = prototype(MOVEMENTS["30L"], "")
    for point in ("chin", "left jaw", "right jaw"):
        assert ways[POINTS.index(point), 0] == 1.0
