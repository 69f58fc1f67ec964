import warnings
from math import inf, nan

import numpy as np
import pytest

from usdface.errors import InputError
from usdface.fuzzy.membership import check_parameters, membership

X = np.array([-inf, -1.0, 0.0, 0.25, 0.5, 1.0, 2.0, 3.0, inf])


@pytest.mark.parametrize(
    ("kind", "parameters", "expected"),
    [
        ("triangular", (0, 0.5, 1), [0, 0, 0, 0.5, 1, 0, 0, 0, 0]),
        ("triangular", (0, 0, 1), [0, 0, 1, 0.75, 0.5, 0, 0, 0, 0]),
        ("triangular", (0, 1, 1), [0, 0, 0, 0.25, 0.5, 1, 0, 0, 0]),
        ("triangular", (1, 1, 1), [0, 0, 0, 0, 0, 1, 0, 0, 0]),
        ("triangular", (-inf, 0, 1), [1, 1, 1, 0.75, 0.5, 0, 0, 0, 0]),
        ("triangular", (0, 1, inf), [0, 0, 0, 0.25, 0.5, 1, 1, 1, 1]),
        ("trapezoidal", (0, 0.5, 1, 3), [0, 0, 0, 0.5, 1, 1, 0.5, 0, 0]),
        ("trapezoidal", (-inf, 0, 1, 3), [1, 1, 1, 1, 1, 1, 0.5, 0, 0]),
        ("ramp", (0, 1), [0, 0, 0, 0.25, 0.5, 1, 1, 1, 1]),
        ("ramp", (1, 0), [1, 1, 1, 0.75, 0.5, 0, 0, 0, 0]),
    ],
)
def test_known_values(kind, parameters, expected):
    check_parameters(kind, parameters)
    np.testing.assert_array_equal(membership(kind, parameters, X), expected)


@pytest.mark.parametrize("parameters", [(0, 1, 2), (0, 0, 2), (-inf, 1, inf)])
def test_nan_belongs_to_nothing(parameters):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert membership("triangular", parameters, np.array([nan]))[0] == 0


def test_a_ramp_mirrors_and_scales():
    x = np.random.default_rng(1).normal(size=100)
    there = membership("ramp", (0.2, 1.5), x)
    np.testing.assert_array_equal(there, membership("ramp", (-0.2, -1.5), -x))
    np.testing.assert_allclose(there, membership("ramp", (0.4, 3.0), 2 * x), atol=1e-15)


@pytest.mark.parametrize(
    ("kind", "parameters", "says"),
    [
        ("bell", (0, 1, 2), "unknown kind"),
        ("triangular", (0, 1), "expected 3 parameters"),
        ("triangular", (0, 2, 1), "ascend"),
        ("triangular", (0, nan, 1), "must be numbers"),
        ("triangular", (-inf, -inf, 1), "outer feet"),
        ("triangular", (inf, inf, inf), "outer feet"),
        ("ramp", (1, 1), "differ"),
        ("ramp", (0, inf), "finite"),
    ],
)
def test_bad_parameters_are_named(kind, parameters, says):
    with pytest.raises(InputError, match=says):
        check_parameters(kind, parameters)
