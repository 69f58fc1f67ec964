import numpy as np
import pytest

from usdface.rule_design.movements import movements


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
