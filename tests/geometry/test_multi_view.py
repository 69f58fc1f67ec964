import numpy as np
import pytest
from camera_worlds import make_cameras, moving_points, project_all

from usdface.geometry.camera import undistort
from usdface.geometry.multi_view import epipolar_distances, triangulate

POINTS = moving_points(50, 20).reshape(-1, 3)


@pytest.mark.parametrize("count", [2, 3, 4])
def test_exact_pixels_give_the_points(count: int) -> None:
    cameras = make_cameras(count)
    solved = triangulate(cameras, project_all(cameras, POINTS))
    np.testing.assert_allclose(solved.points, POINTS, atol=1e-10)
    assert np.max(solved.residuals) < 1e-6


@pytest.mark.parametrize("count", [2, 4])
def test_noise_moves_points_as_the_covariance_predicts(count: int) -> None:
    cameras, sigma = make_cameras(count), 0.3
    points = np.tile(POINTS, (10, 1))
    noise = np.random.default_rng(1).normal(0, sigma, (count, len(points), 2))
    solved = triangulate(cameras, project_all(cameras, points) + noise)
    away = solved.points - points
    scaled = np.einsum("ni,nij,nj->n", away, np.linalg.inv(solved.spread * sigma**2), away)
    # Chi-squared of three degrees of freedom: mean 3, deviation of the mean of 10,000 0.024.
    assert abs(scaled.mean() - 3) < 0.1
    # The squares of the pixels' errors lose three degrees of freedom of 2 C to the point.
    left = (solved.residuals**2).sum(axis=0).mean() / sigma**2
    assert abs(left - (2 * count - 3)) < 0.1


def test_another_camera_makes_points_surer() -> None:
    two, three = (
        triangulate(c, project_all(c, POINTS)).spread.trace(axis1=1, axis2=2).mean()
        for c in (make_cameras(2), make_cameras(3))
    )
    assert three < 0.5 * two


def test_what_one_camera_sees_has_no_point() -> None:
    cameras = make_cameras(3)
    pixels = project_all(cameras, POINTS[:3])
    pixels[1:, 0] = np.nan
    pixels[2, 1] = np.nan
    solved = triangulate(cameras, pixels)
    assert np.isfinite(solved.points[:, 0]).tolist() == [False, True, True]
    assert np.isfinite(solved.residuals).tolist() == [
        [False, True, True],
        [False, True, True],
        [False, False, True],
    ]
    np.testing.assert_allclose(solved.points[1:], POINTS[1:3], atol=1e-10)


def test_parallel_rays_and_points_behind_a_camera_are_none() -> None:
    first, second = make_cameras(2)
    pixels = project_all((first, first), POINTS[:2])
    assert np.isnan(triangulate((first, first), pixels).points).all()
    # Rays that part in front of the cameras cross behind them.
    pixels = project_all((first, second), POINTS[:2])
    pixels[0, :, 0] += 900
    pixels[1, :, 0] -= 900
    assert np.isnan(triangulate((first, second), pixels).points).all()


def test_pixels_of_one_point_have_no_epipolar_distance() -> None:
    cameras = make_cameras(3)[1:]
    pixels = project_all(cameras, POINTS)
    first, second = (undistort(c, p) for c, p in zip(cameras, pixels, strict=True))
    assert epipolar_distances(*cameras, first, second).max() < 1e-6
    # Where epipolar lines run along the rows, a shift by rows is shared by both images.
    shifted = undistort(cameras[1], pixels[1] + np.array([0.0, 1.0]))
    away = epipolar_distances(*cameras, first, shifted)
    np.testing.assert_allclose(np.median(away), 1 / np.sqrt(2), rtol=0.1)


def test_nothing_is_nothing() -> None:
    assert triangulate(make_cameras(2), np.empty((2, 0, 2))).points.shape == (0, 3)
