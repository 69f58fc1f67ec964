import numpy as np
import pytest

from usdface.options import SolveOptions
from usdface.retarget.solver.covariance import inverse_spectrum
from usdface.retarget.solver.regularisation import Regularisation

OPTIONS = SolveOptions(spread=0.5, agility=27.0, smoothness=2.0, sparsity=0.7, symmetry=30.0)
NAMES = ("smileLeft", "jawOpen", "smileRight")
TIMES = np.arange(5.0)


def parts(held: Regularisation) -> list[np.ndarray]:
    nothing = np.zeros((3, 3)), np.zeros((1, 3))
    return [held.added_to(nothing[0]), held.pulled(nothing[1]), held.bands(TIMES)]


def test_markers_that_do_not_err_leave_weights_free() -> None:
    for part in parts(Regularisation(0.0, 0.0, OPTIONS, NAMES)):
        assert not part.any()


def test_terms_are_of_the_unit_of_the_squares() -> None:
    """In millimetres the squares are a million times as large, and so is all beside them."""
    metres, millimetres = (
        parts(Regularisation(3e-4 * k, 1e-3 * k, OPTIONS, NAMES, size=0.06 * k))
        for k in (1.0, 1000.0)
    )
    for large, small in zip(millimetres, metres, strict=True):
        assert small.any()
        np.testing.assert_allclose(large, 1e6 * small, rtol=1e-12)


def test_only_misfit_lasts() -> None:
    noisy, misfitting = Regularisation(0.3, 0.0, OPTIONS), Regularisation(0.0, 0.3, OPTIONS)
    assert noisy.lasting_variance == 0.0 and noisy.variance == pytest.approx(0.09)
    assert misfitting.lasting_variance == misfitting.variance > 0.0
    assert not misfitting.bands(TIMES).any()


def test_a_learned_covariance_takes_the_place_of_the_ridge_for_noise() -> None:
    learned = Regularisation(0.3, 0.1, SolveOptions(), covariance=np.eye(3))
    np.testing.assert_allclose(learned.added_to(np.zeros((3, 3))), 2 * 0.1**2 / 0.5**2 * np.eye(3))
    np.testing.assert_allclose(
        learned.precision(3), np.eye(3) / 0.5**2, err_msg="what was expected before the take"
    )


def test_no_shapes_are_paired_unless_named() -> None:
    matrix = Regularisation(0.3, 0.0, OPTIONS).added_to(np.zeros((3, 3)))
    assert (matrix == np.diag(np.diag(matrix))).all()


@pytest.mark.parametrize("covariance", [None, np.eye(3)])
def test_the_spectrum_is_that_of_the_bands(covariance: np.ndarray | None) -> None:
    held = Regularisation(0.3, 0.1, OPTIONS, covariance=covariance)
    angles, step = np.array([0.1, 1.0, np.pi]), 1 / 60
    known = (2 - 2 * np.cos(angles)) ** 2 / step**3 / OPTIONS.agility
    if covariance is not None:
        known = inverse_spectrum(angles, step, OPTIONS.pace)
    np.testing.assert_allclose(held.spectrum(angles, step), 0.3**2 * 2 * known, rtol=1e-9)
    assert not held.spectrum(angles, 0.0).any()
