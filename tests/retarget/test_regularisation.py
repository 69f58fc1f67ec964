import numpy as np
import pytest

from usdface.options import SolveOptions
from usdface.retarget.regularisation import Regularisation

OPTIONS = SolveOptions(spread=0.5, agility=27.0, smoothness=2.0, sparsity=0.7, symmetry=30.0)
TERMS = ("ridge", "lasting_ridge", "sparsity", "symmetry", "stiffness")


def test_the_terms_are_those_of_the_equation() -> None:
    held = Regularisation(0.3, 0.1, OPTIONS)
    error = 0.3**2 + 5 * 0.1**2
    assert held.variance == pytest.approx(error)
    assert held.ridge == pytest.approx(4 * error)
    assert held.sparsity == pytest.approx(0.7 * error)
    assert held.symmetry == pytest.approx(30 * error)
    assert held.stiffness == pytest.approx(0.3**2 * 2 / 27)


def test_markers_that_do_not_err_leave_weights_free() -> None:
    exact = Regularisation(0.0, 0.0, OPTIONS)
    assert not any(getattr(exact, term) for term in TERMS)


def test_terms_are_of_the_unit_of_the_squares() -> None:
    """In millimetres the squares are a million times as large, and so is all beside them."""
    metres, millimetres = (Regularisation(3e-4 * k, 1e-3 * k, OPTIONS) for k in (1.0, 1000.0))
    for term in TERMS:
        assert getattr(millimetres, term) == pytest.approx(1e6 * getattr(metres, term))


def test_only_misfit_lasts() -> None:
    noisy, misfitting = Regularisation(0.3, 0.0, OPTIONS), Regularisation(0.0, 0.3, OPTIONS)
    assert noisy.lasting_ridge == noisy.lasting_variance == 0.0
    assert misfitting.lasting_ridge == misfitting.ridge > 0.0
    assert misfitting.stiffness == 0.0


def test_no_shapes_are_paired_unless_said() -> None:
    assert Regularisation(0.0, 0.0, OPTIONS).pairs.shape == np.zeros((0, 2)).shape
