"""Errors of the motion over frames: their covariance, and how they come from noise and misfit."""

import numpy as np
import pytest

from usdface.options import SolveOptions
from usdface.retarget.motion_errors import MotionErrors
from usdface.retarget.solver.regularisation import Regularisation

RNG = np.random.default_rng(1)
WEIGHTS = RNG.random((40, 3))
VARIANCES = np.array([1e-6, 0.0, 4e-6])
ERRORS = MotionErrors(5e-4**2, WEIGHTS, VARIANCES)


def test_values_are_weighted_by_the_inverse_covariance_of_the_frames() -> None:
    covariance = 30.0 * 5e-4**2 * np.eye(40) + WEIGHTS @ np.diag(VARIANCES) @ WEIGHTS.T
    values = RNG.normal(size=(40, 5))
    expected = np.linalg.solve(covariance, values)
    np.testing.assert_allclose(ERRORS.weighted(values), expected, rtol=1e-9, atol=1e-9)


def test_without_errors_of_the_shapes_thirty_frames_count_as_one() -> None:
    alone = MotionErrors(5e-4**2, WEIGHTS, 0.0 * VARIANCES)
    values = RNG.normal(size=(40, 5))
    np.testing.assert_allclose(alone.weighted(values), values / (30.0 * 5e-4**2))


def test_some_frames_stand_for_all() -> None:
    """Each tenth frame of a take that repeats itself tells as much as the whole."""
    long = MotionErrors(5e-4**2, np.repeat(WEIGHTS, 10, axis=0), VARIANCES)
    values = RNG.normal(size=(40, 2))
    whole = np.repeat(values, 10, axis=0)
    some = long.at(np.arange(0, 400, 10))
    np.testing.assert_allclose(
        values.T @ some.weighted(values), whole.T @ long.weighted(whole), rtol=1e-9
    )


def test_a_movement_that_is_repeated_tells_no_more_than_its_shape_is_known() -> None:
    """The evidence of a shift along the shape ends at the inverse variance of the shape."""
    for count in (10**3, 10**5):
        errors = MotionErrors(1e-9, np.ones((count, 1)), np.array([4e-6]))
        ones = np.ones((count, 1))
        assert (ones.T @ errors.weighted(ones)).item() == pytest.approx(1 / 4e-6, rel=1e-2)


def test_shapes_err_in_the_ratio_of_misfit_to_motion() -> None:
    """A misfit of a tenth of the motion, which counts as two: also of markers that are hidden."""
    offsets = np.array([[3e-3, 0.0, 0.0, 3e-3, 0.0, 0.0], [0.0, 1e-3, 0.0, 0.0, 1e-3, 0.0]])
    weights = np.column_stack([np.linspace(0.0, 1.0, 101), np.zeros(101)])
    displaced = (weights @ offsets).reshape(-1, 2, 3)
    displaced[::2, 1] = np.nan
    motion = np.sqrt((0.9 * 3e-3) ** 2 / 3)
    held = Regularisation(1e-5, 0.1 * motion, SolveOptions())
    errors = MotionErrors.of(held, weights, offsets, displaced)
    assert errors.variance == held.variance
    np.testing.assert_allclose(
        errors.shape_variances, 2 * 0.1**2 * np.array([3e-6, 1e-6 / 3]), rtol=0.01
    )


def test_a_face_that_rests_has_no_errors_of_shapes() -> None:
    held = Regularisation(1e-5, 1e-4, SolveOptions())
    errors = MotionErrors.of(held, np.zeros((9, 2)), np.ones((2, 6)), np.zeros((9, 2, 3)))
    assert not errors.shape_variances.any()
    assert np.isfinite(errors.weighted(np.ones((9, 4)))).all()
