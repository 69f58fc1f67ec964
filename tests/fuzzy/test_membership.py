import warnings
from math import inf, nan

import fuzzylite as fl
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
        ("bump", (0, 1, 2), "unknown kind"),
        ("gaussian", (0, 0), "deviation is 0; expected a number above 0"),
        ("gaussian", (inf, 1), "finite"),
        ("sigmoid", (0, 0), "slope is 0; expected a number other than 0"),
        ("bell", (0, -1, 2), "width is -1; expected a number above 0"),
        ("bell", (0, 1, -2), "slope is -2; expected a number above 0"),
        ("s_shape", (1, 0), "expected foot, top from left to right"),
        ("pi_shape", (-inf, 0, 1, 2), "finite"),
        ("constant", (1, 2), "expected 1 parameters"),
        ("linear", (1, nan), "not a number; expected factor_1, constant"),
        ("points", (0, 1), "expected 4 parameters, x, height, x, height"),
        ("points", (0, 1, 2), "expected 4 parameters"),
        ("points", (0, 1, 0, 0), "from left to right"),
        ("points", (0, 1, 1, 1.1), "expected heights of points from 0 to 1"),
        ("points", (0, 1, inf, 0), "finite"),
        ("triangular", (0, 1), "expected 3 parameters"),
        ("triangular", (0, 2, 1), "expected left, peak, right from left to right"),
        ("triangular", (0, nan, 1), "not a number; expected left, peak, right"),
        ("triangular", (-inf, -inf, 1), "outer feet"),
        ("triangular", (inf, inf, inf), "outer feet"),
        ("ramp", (1, 1), "finite and apart"),
        ("ramp", (0, inf), "finite"),
    ],
)
def test_bad_parameters_are_named(kind, parameters, says):
    with pytest.raises(InputError, match=says):
        check_parameters(kind, parameters)


FL_KINDS = {
    "gaussian": (fl.Gaussian, (0.3, 0.7)),
    "gaussian_pair": (fl.GaussianProduct, (-0.5, 0.3, 0.6, 0.8)),
    "sigmoid": (fl.Sigmoid, (0.2, -4)),
    "bell": (fl.Bell, (0.1, 0.8, 1.5)),
    "s_shape": (fl.SShape, (-1, 0.5)),
    "z_shape": (fl.ZShape, (-1, 0.5)),
    "pi_shape": (fl.PiShape, (-1, 0, 0.5, 1)),
    "points": (lambda name, *p: fl.Discrete(name, p), (-1, 0.25, 0, 1, 0.5, 0, 1, 0.5)),
}


@pytest.mark.parametrize("kind", FL_KINDS)
def test_smooth_kinds_agree_with_pyfuzzylite(kind):
    term, parameters = FL_KINDS[kind]
    check_parameters(kind, parameters)
    x = np.linspace(-2, 2, 401)
    judge = term("t", *parameters)
    expected = [judge.membership(float(value)) for value in x]
    np.testing.assert_allclose(membership(kind, parameters, x), expected, atol=1e-14)


def test_a_gaussian_pair_whose_flanks_cross_is_nowhere_1_as_in_pyfuzzylite_and_matlab():
    crossed = (0.6, 0.3, -0.5, 0.8)
    check_parameters("gaussian_pair", crossed)
    x = np.linspace(-2, 2, 401)
    judge = fl.GaussianProduct("t", *crossed)
    found = membership("gaussian_pair", crossed, x)
    np.testing.assert_allclose(found, [judge.membership(float(v)) for v in x], atol=1e-14)
    assert 0.1 < found.max() < 1


@pytest.mark.parametrize("kind", FL_KINDS)
def test_smooth_kinds_survive_the_ends_of_the_line(kind):
    ends = membership(kind, FL_KINDS[kind][1], np.array([-inf, -1e300, 1e300, inf, nan]))
    assert ((ends >= 0) & (ends <= 1)).all() and ends[-1] == 0
