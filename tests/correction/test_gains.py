import numpy as np
import pytest

from usdface.correction.gains import Gains
from usdface.errors import InputError
from usdface.setup.expression import Expression


def test_a_part_has_the_product_of_its_gains():
    gains = Gains(
        np.array([0.5]),
        {"joy": np.array([1.0, 0.5, 0.0])},
        {"mouth": np.array([2.0]), "eyes": np.array([0.0, 1.0, 1.0])},
    )
    parts = (("joy", "mouth"), ("joy", None), ("anger", "eyes"), ("anger", "brows"))
    np.testing.assert_array_equal(gains.of(parts, 3), [[2, 1, 0, 1], [1, 0.5, 1, 1], [0, 0, 1, 1]])


def test_constant_gains_are_those_of_system_and_expressions():
    gains = Gains.constant(0.7, [Expression("joy", ("smile",), np.ones(1), 0.3)])
    assert gains.system == 0.7
    np.testing.assert_array_equal(gains.of([("joy", None)], 2), [[0.3], [0.3]])


@pytest.mark.parametrize("bad", [-0.1, np.nan, np.inf])
def test_a_gain_below_0_is_refused(bad):
    with pytest.raises(InputError, match="gain"):
        Gains(regions={"mouth": np.array([1.0, bad])})
