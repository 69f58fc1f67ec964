"""The perspective camera against the projection written out, and poses that are known."""

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from usdface.errors import SolveError
from usdface.geometry.rigid_fit import Pose
from usdface.retarget.film.one_camera import PinholeCamera, fit_pose, pose_columns, start_pose

CAMERA = PinholeCamera(900.0, np.array([640.0, -480.0]))
FACE = np.random.default_rng(2).uniform(-1, 1, (20, 3)) * [0.07, 0.09, 0.04]
BEFORE = np.array([0.05, -0.02, -0.6])


def turned(*angles: tuple[float, float, float]) -> Pose:
    turns = Rotation.from_euler("xyz", np.array(angles), degrees=True)
    shifts = np.random.default_rng(3).normal(scale=0.02, size=(len(angles), 3))
    return Pose(turns.as_matrix(), BEFORE + shifts)


POSE = turned((0, 0, 0), (10, 20, -5), (-15, -35, 10), (5, 50, 0))
IMAGE = CAMERA.image(POSE.to_take(np.tile(FACE, (4, 1, 1))))


def test_a_point_on_the_axis_is_at_the_centre_and_nearer_ones_are_larger() -> None:
    np.testing.assert_allclose(CAMERA.image(np.array([0.0, 0.0, -2.0])), CAMERA.centre)
    near, far = (CAMERA.image(np.array([0.1, 0.0, -z]))[0] - 640.0 for z in (0.5, 1.0))
    assert near == pytest.approx(180.0) and far == pytest.approx(90.0)


def test_slopes_and_pose_columns_are_derivatives() -> None:
    points, step = FACE + BEFORE, 1e-6
    for axis in range(3):
        moved = points + step * np.eye(3)[axis]
        quotient = (CAMERA.image(moved) - CAMERA.image(points)) / step
        np.testing.assert_allclose(CAMERA.slopes(points)[..., axis], quotient, rtol=1e-4, atol=0.1)
    columns = pose_columns(FACE, POSE, CAMERA)
    for k, change in enumerate(np.eye(6) * step):
        turn = Rotation.from_rotvec(change[:3]).as_matrix()
        after = Pose(turn @ POSE.rotations, POSE.translations + change[3:])
        moved = CAMERA.image(after.to_take(np.tile(FACE, (4, 1, 1))))
        np.testing.assert_allclose(columns[..., k], (moved - IMAGE) / step, rtol=1e-4, atol=0.1)


def test_a_ray_meets_the_point_it_came_from() -> None:
    np.testing.assert_allclose(
        CAMERA.at_depths(IMAGE, POSE, FACE[:, 2]), np.tile(FACE, (4, 1, 1)), atol=1e-12
    )


def test_the_pose_is_found_from_a_face_that_looks_at_the_camera() -> None:
    found = fit_pose(FACE, IMAGE, CAMERA, start_pose(FACE, IMAGE, CAMERA))
    np.testing.assert_allclose(found.rotations, POSE.rotations, atol=1e-8)
    np.testing.assert_allclose(found.translations, POSE.translations, atol=1e-8)


def test_noisy_images_have_the_pose_that_scipy_finds() -> None:
    noisy = IMAGE + np.random.default_rng(4).normal(size=IMAGE.shape)
    noisy[1, :7] = np.nan
    found = fit_pose(FACE, noisy, CAMERA, start_pose(FACE, noisy, CAMERA))

    def left(numbers: np.ndarray) -> np.ndarray:
        placed = Rotation.from_rotvec(numbers[:3]).apply(FACE) + numbers[3:]
        return (CAMERA.image(placed) - noisy[1])[7:].ravel()

    best = least_squares(left, [*np.radians([10, 20, -5]), *BEFORE], xtol=1e-14, ftol=1e-14)
    np.testing.assert_allclose(
        found.rotations[1], Rotation.from_rotvec(best.x[:3]).as_matrix(), atol=1e-6
    )
    np.testing.assert_allclose(found.translations[1], best.x[3:], atol=1e-6)


def test_a_frame_with_three_markers_keeps_the_pose_beside_it() -> None:
    hidden = IMAGE.copy()
    hidden[2, 3:] = np.nan
    found = fit_pose(FACE, hidden, CAMERA, start_pose(FACE, IMAGE, CAMERA))
    np.testing.assert_array_equal(found.rotations[2], found.rotations[3])


def test_a_take_without_four_markers_in_a_frame_is_refused() -> None:
    with pytest.raises(SolveError, match="4 bound markers at once"):
        fit_pose(FACE[:3], IMAGE[:, :3], CAMERA, POSE)
