import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from usdface.geometry.rigid_modes import motion_basis, small_motions

POINTS = np.random.default_rng(3).normal(size=(12, 3)) * [0.07, 0.09, 0.03]


def test_a_small_rigid_motion_is_made_of_them() -> None:
    moved = Rotation.from_rotvec([1e-6, -2e-6, 3e-6]).apply(POINTS) + np.array([1e-6, 0.0, 2e-6])
    columns = small_motions(POINTS, False).reshape(6, -1).T
    left = np.linalg.lstsq(columns, (moved - POINTS).ravel(), rcond=None)[1]
    assert np.sqrt(left[0]) < 1e-5 * np.linalg.norm(moved - POINTS)


def test_in_an_image_moving_along_the_view_is_a_change_of_size() -> None:
    centred = POINTS - POINTS.mean(axis=0)
    np.testing.assert_array_equal(small_motions(POINTS, True)[2], centred)


@pytest.mark.parametrize("axes", [2, 3])
def test_the_basis_is_orthonormal_and_spans_them(axes: int) -> None:
    basis = motion_basis(POINTS, axes)
    np.testing.assert_allclose(basis.T @ basis, np.eye(6), atol=1e-12)
    flat = small_motions(POINTS, axes == 2)[..., :axes].reshape(6, -1)
    np.testing.assert_allclose((flat @ basis) @ basis.T, flat, atol=1e-12)
