import numpy as np
import pytest
from marker_face import marker_face

from usdface.rule_design.movements import (
    in_columns,
    mixed_movements,
    movements,
    moving_shapes,
    single_movements,
)


def test_movements_are_alone_and_both_sides_and_several_at_a_time():
    found = movements(("smile_L", "smile_R", "jaw"))
    assert {tuple(row) for row in found.single} == {(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0)}
    assert {tuple(row) for row in found.whole} == {(0, 0, 1), (1, 1, 0)}
    assert (found.mixed[:, 0] == found.mixed[:, 1]).all() and found.mixed.all()
    assert found.mixed.min() >= 0.2 and found.mixed.max() <= 1
    np.testing.assert_array_equal(found.mixed, movements(("smile_L", "smile_R", "jaw")).mixed)


@pytest.mark.parametrize(
    "pair",
    [
        ("mouthSmileLeft", "mouthSmileRight"),
        ("mouthSmile_L", "mouthSmile_R"),
        ("eye-left-slit", "eye-right-slit"),
        ("L_smile", "R_smile"),
        ("smile.l", "smile.r"),
    ],
)
def test_sides_are_known_by_their_names(pair):
    assert movements(pair).whole.tolist() == [[1, 1]]
    assert movements((pair[0], "Lower" + pair[1])).whole.tolist() == [[1, 0], [0, 1]]


@pytest.mark.parametrize("names", [(), ("jaw",)])
def test_one_blend_shape_makes_no_mixture(names):
    assert movements(names).mixed.shape == (0, len(names))


def test_mixtures_are_of_two_to_five_movements():
    names = ("smile_L", "smile_R", *(f"shape{i}" for i in "abcdefgh"))
    mixed = mixed_movements(names, 500, np.random.default_rng(1))
    assert mixed.shape == (500, 10) and (mixed[:, 0] == mixed[:, 1]).all()
    of = (mixed[:, 1:] > 0.0).sum(axis=1)
    assert set(of) == {2, 3, 4, 5}
    assert mixed[mixed > 0.0].min() >= 0.2 and mixed.max() <= 1.0
    np.testing.assert_array_equal(mixed, mixed_movements(names, 500, np.random.default_rng(1)))
    assert mixed_movements(names[2:3], 500, np.random.default_rng(1)).shape == (0, 1)


def test_shapes_that_move_no_marker_are_none_of_a_face():
    basis = 0.01 * np.random.default_rng(1).normal(size=(4, 3, 3))
    basis[1] = 0.0
    moving, columns = moving_shapes(
        marker_face("abc", np.eye(3), basis, ("smile_L", "ear", "smile_R", "jaw"), "a")
    )
    assert moving == ("smile_L", "smile_R", "jaw")
    wide = in_columns(single_movements(moving), columns)
    np.testing.assert_array_equal(wide[:, columns], single_movements(moving))
    assert not wide[:, 1].any()
