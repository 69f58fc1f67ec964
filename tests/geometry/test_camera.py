import numpy as np
import pytest
from camera_worlds import make_cameras, moving_points

from usdface.errors import InputError
from usdface.geometry.camera import Camera, project, projection_and_jacobian, undistort

CAMERA = make_cameras(2)[1]
POINTS = moving_points(3, 20)


def test_a_projection_follows_the_published_formula() -> None:
    x, y, z = CAMERA.rotation @ POINTS[0, 0] + CAMERA.translation
    k1, k2, p1, p2, k3 = CAMERA.distortion[:5]
    x, y = x / z, y / z
    r2 = x**2 + y**2
    radial = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    u = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x**2)
    v = y * radial + p1 * (r2 + 2 * y**2) + 2 * p2 * x * y
    expected = [1410 * u + 655.5, 1395 * v + 471.25]
    np.testing.assert_allclose(project(CAMERA, POINTS[0, 0]), expected, rtol=1e-12)


@pytest.mark.parametrize("rational", [0.0, 0.1])
def test_the_derivative_is_that_of_the_projection(rational: float) -> None:
    camera = Camera(
        CAMERA.matrix,
        [*CAMERA.distortion[:5], rational, -rational / 2, rational / 3],
        CAMERA.rotation,
        CAMERA.translation,
    )
    _, jacobian, depth = projection_and_jacobian(camera, POINTS)
    step = 1e-6
    for axis in range(3):
        away = step * np.eye(3)[axis]
        found = (project(camera, POINTS + away) - project(camera, POINTS - away)) / (2 * step)
        np.testing.assert_allclose(jacobian[..., axis], found, atol=1e-4)
    assert (depth > 0.4).all()


def test_undistorted_rays_go_through_the_points() -> None:
    inside = POINTS @ CAMERA.rotation.T + CAMERA.translation
    flat = undistort(CAMERA, project(CAMERA, POINTS))
    np.testing.assert_allclose(flat, inside[..., :2] / inside[..., 2:], atol=1e-9)


def test_pixels_beyond_the_fold_of_a_lens_have_no_ray() -> None:
    fold = Camera([[1000, 0, 0], [0, 1000, 0], [0, 0, 1]], [-0.3, *[0] * 7], np.eye(3), np.zeros(3))
    # x (1 - 0.3 x^2) is never more than 0.703.
    flat = undistort(fold, np.array([[690.0, 0.0], [720.0, 0.0], [np.nan, 0.0]]))
    assert np.isfinite(flat).all(axis=1).tolist() == [True, False, False]
    np.testing.assert_allclose(flat[0, 0] * (1 - 0.3 * flat[0, 0] ** 2), 0.69, atol=1e-9)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("matrix", np.zeros((3, 3))),
        ("matrix", np.full((3, 3), np.nan)),
        ("distortion", np.zeros(5)),
        ("rotation", -np.eye(3)),
        ("rotation", 2 * np.eye(3)),
        ("translation", np.full(3, np.inf)),
    ],
)
def test_what_is_no_camera_is_refused(field: str, value: np.ndarray) -> None:
    given = {
        name: getattr(CAMERA, name) for name in ("matrix", "distortion", "rotation", "translation")
    }
    with pytest.raises(InputError):
        Camera(**given | {field: value})
