"""Calibrated cameras with lens distortion, in OpenCV's convention.

A point X of the world is at ``R X + t`` in the camera's space: x right, y down, z ahead. The centre
of the top left pixel is (0, 0). Distortion: OpenCV's documentation of calib3d, radial (k1, k2, k3),
its rational form (k4, k5, k6) and tangential (p1, p2).
"""

from dataclasses import dataclass

import numpy as np

from usdface.arrays import FloatArray, freeze
from usdface.errors import InputError

__all__ = ["COEFFICIENTS", "Camera", "project", "projection_and_jacobian", "undistort"]

COEFFICIENTS = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
_ITERATIONS = 100
_CONVERGED = 1e-9  # in the plane at depth 1; 1e-6 px at a focal length of 1000 px


@dataclass(frozen=True, eq=False, slots=True)
class Camera:
    """A camera.

    Attributes
    ----------
    matrix : (3, 3) float64 [px]
        Focal lengths and principal point.
    distortion : (8,) float64 [1]
        In the order of `COEFFICIENTS`.
    rotation : (3, 3) float64
        From the world to the camera, for column vectors.
    translation : (3,) float64
        In the unit of the world.
    image_size : (int, int) or None
        Width and height [px] of the images that it was calibrated on.
    name : str

    Raises
    ------
    InputError
        If an array has another shape or is not finite, the matrix is none of a camera, or the
        rotation is none.
    """

    matrix: FloatArray
    distortion: FloatArray
    rotation: FloatArray
    translation: FloatArray
    image_size: tuple[int, int] | None = None
    name: str = ""

    def __post_init__(self) -> None:
        shapes = {"matrix": (3, 3), "distortion": (8,), "rotation": (3, 3), "translation": (3,)}
        freeze(self, *shapes)
        for field, shape in shapes.items():
            array = getattr(self, field)
            if array.shape != shape or not np.isfinite(array).all():
                raise InputError(
                    f"camera {self.name!r}: {field} has shape {array.shape}; expected {shape}, "
                    "all finite",
                    "VALUES_WRONG",
                )
        focal = self.matrix[[0, 1], [0, 1]]
        corner = self.matrix[[1, 2, 2], [0, 0, 1]]
        if (focal <= 0).any() or np.abs(corner).max() > 1e-9 or abs(self.matrix[2, 2] - 1) > 1e-9:
            raise InputError(
                f"camera {self.name!r}: expected the matrix [fx s cx; 0 fy cy; 0 0 1]",
                "VALUES_WRONG",
            )
        away = np.abs(self.rotation @ self.rotation.T - np.eye(3)).max()
        if away > 1e-6 or np.linalg.det(self.rotation) < 0:
            raise InputError(
                f"camera {self.name!r}: its rotation matrix is no rotation", "VALUES_WRONG"
            )


def project(camera: Camera, points: FloatArray) -> FloatArray:
    """Return the pixels (..., 2) of points (..., 3) of the world."""
    return projection_and_jacobian(camera, points)[0]


def projection_and_jacobian(
    camera: Camera, points: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return pixels (..., 2), their derivatives by the points (..., 2, 3), and depths (...)."""
    inside = points @ camera.rotation.T + camera.translation
    depth = inside[..., 2]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        flat = inside[..., :2] / depth[..., None]
        bent, bending = _distorted(camera.distortion, flat)
        inverse = 1.0 / depth
        along = np.zeros((*flat.shape, 3))
        along[..., 0, 0] = along[..., 1, 1] = inverse
        along[..., 2] = -flat * inverse[..., None]
        lens = camera.matrix[:2, :2]
        pixels = bent @ lens.T + camera.matrix[:2, 2]
        jacobian = lens @ bending @ along @ camera.rotation
    return pixels, jacobian, depth


def undistort(camera: Camera, pixels: FloatArray) -> FloatArray:
    """Return where rays through pixels (..., 2) meet the plane at depth 1, without distortion.

    By Newton's iteration. NaN where it does not converge: outside the domain of the coefficients.
    """
    bent = (pixels - camera.matrix[:2, 2]) @ np.linalg.inv(camera.matrix[:2, :2]).T
    flat = bent.copy()
    step = np.full_like(bent, np.inf)
    with np.errstate(all="ignore"):
        for _ in range(_ITERATIONS):
            value, slope = _distorted(camera.distortion, flat)
            determinant = slope[..., 0, 0] * slope[..., 1, 1] - slope[..., 0, 1] * slope[..., 1, 0]
            away = value - bent
            step = np.stack(
                [
                    slope[..., 1, 1] * away[..., 0] - slope[..., 0, 1] * away[..., 1],
                    slope[..., 0, 0] * away[..., 1] - slope[..., 1, 0] * away[..., 0],
                ],
                axis=-1,
            )
            step /= determinant[..., None]
            flat = flat - step
            if not (np.abs(step) > _CONVERGED).any():
                break
        # Beyond its fold the distortion is not injective; Newton may jump across it.
        straight = (determinant > 0) & (slope[..., 0, 0] + slope[..., 1, 1] > 0)
        unfolded = straight & (np.abs(step).max(axis=-1) <= _CONVERGED)
    return np.where(unfolded[..., None], flat, np.nan)


def _distorted(coefficients: FloatArray, flat: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return distorted places (..., 2) in the plane at depth 1, and derivatives (..., 2, 2)."""
    k1, k2, p1, p2, k3, k4, k5, k6 = coefficients
    x, y = flat[..., 0], flat[..., 1]
    r2 = x * x + y * y
    above = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    below = 1 + r2 * (k4 + r2 * (k5 + r2 * k6))
    radial = above / below
    # Derivative of the radial factor by r2.
    rise = (k1 + r2 * (2 * k2 + 3 * r2 * k3)) / below
    rise -= radial * (k4 + r2 * (2 * k5 + 3 * r2 * k6)) / below
    bent = np.stack(
        [
            x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
            y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y,
        ],
        axis=-1,
    )
    slope = np.empty((*flat.shape, 2))
    slope[..., 0, 0] = radial + 2 * x * x * rise + 2 * p1 * y + 6 * p2 * x
    slope[..., 0, 1] = slope[..., 1, 0] = 2 * x * y * rise + 2 * p1 * x + 2 * p2 * y
    slope[..., 1, 1] = radial + 2 * y * y * rise + 6 * p1 * y + 2 * p2 * x
    return bent, slope
