import numpy as np
import pytest

from usdface.errors import InputError
from usdface.setup.expression import Expression


def test_a_pose_is_an_expressions_weights_in_another_order() -> None:
    expression = Expression("joy", ("a", "b"), np.array([0.2, 0.7]))
    np.testing.assert_array_equal(expression.pose(("b", "x", "a")), [0.7, 0.0, 0.2])
    np.testing.assert_array_equal(expression.pose(("x",)), [0.0])


@pytest.mark.parametrize("weights", [[0.5], [0.5, 1.1], [-0.1, 0.5], [np.nan, 0.5]])
def test_an_expression_has_a_weight_in_0_to_1_for_each_shape(weights: list[float]) -> None:
    with pytest.raises(InputError, match="'joy'"):
        Expression("joy", ("a", "b"), np.array(weights))
