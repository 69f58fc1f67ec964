"""Points in space from the pixels of several calibrated cameras."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.geometry.camera import Camera, projection_and_jacobian, undistort

__all__ = ["PointsOfViews", "epipolar_distances", "triangulate"]

_ITERATIONS = 20
_CONVERGED = 1e-12  # of the distance to the cameras
_AT_ONCE = 50_000  # points; their derivatives take 50 MB in four cameras
# Largest ratio of the uncertainty along and across the rays: 1000 are rays 0.1 degrees apart.
_LARGEST_RATIO = 1e3


@dataclass(frozen=True, eq=False, slots=True)
class PointsOfViews:
    """Points and how well they fit.

    Attributes
    ----------
    points : (N, 3) float64
        In the world; NaN where fewer than two cameras see one, their rays are parallel, or the
        point would be behind a camera.
    residuals : (C, N) float64 [px]
        Distance of each pixel from the projection of its point; NaN where there is none.
    spread : (N, 3, 3) float64
        Covariance of each point for pixels with a standard deviation of 1 px.
    """

    points: FloatArray
    residuals: FloatArray
    spread: FloatArray


def triangulate(cameras: Sequence[Camera], pixels: FloatArray) -> PointsOfViews:
    """Return the points whose projections lie nearest to the pixels.

    Least squares of the distances in the images, which is the most likely place where their errors
    are normal: a linear start, then Gauss-Newton. R. Hartley, A. Zisserman: Multiple View Geometry
    in Computer Vision, 2nd edition, chapter 12.

    Parameters
    ----------
    cameras : sequence of Camera, length C
    pixels : (C, N, 2) float64 [px]
        With the lens' distortion; NaN = not seen.
    """
    count = pixels.shape[1]
    parts = [
        _triangulate(cameras, pixels[:, begin : begin + _AT_ONCE])
        for begin in range(0, max(count, 1), _AT_ONCE)
    ]
    return PointsOfViews(
        np.concatenate([part.points for part in parts]),
        np.concatenate([part.residuals for part in parts], axis=1),
        np.concatenate([part.spread for part in parts]),
    )


def epipolar_distances(
    first: Camera, second: Camera, flat: FloatArray, other: FloatArray
) -> FloatArray:
    """Return the least distance of places in two images from epipolar consistency: (...) [px].

    `flat` and `other` (..., 2) are undistorted places in the first and the second image. The first-
    order (Sampson) distance. R. Hartley, A. Zisserman: Multiple View Geometry in Computer Vision,
    2nd edition, 11.4.3. NaN where one is not seen.
    """
    turn = second.rotation @ first.rotation.T
    x, y, z = second.translation - turn @ first.translation
    essential = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]) @ turn
    near, far = (
        np.concatenate([places, np.ones_like(places[..., :1])], axis=-1) for places in (flat, other)
    )
    lines, back = near @ essential.T, far @ essential
    with np.errstate(divide="ignore", invalid="ignore"):
        steepness = np.sqrt((lines[..., :2] ** 2).sum(-1) + (back[..., :2] ** 2).sum(-1))
        away = np.abs((far * lines).sum(axis=-1)) / steepness
    return np.asarray(away * first.matrix[0, 0])


def _triangulate(cameras: Sequence[Camera], pixels: FloatArray) -> PointsOfViews:
    flat = np.stack([undistort(c, p) for c, p in zip(cameras, pixels, strict=True)])
    seen: BoolArray = np.asarray(np.isfinite(flat).all(axis=2))
    points = _linear(cameras, flat, seen)
    points[seen.sum(axis=0) < 2] = np.nan
    for _ in range(_ITERATIONS):
        normal, gradient, _, _ = _normal_equations(cameras, pixels, seen, points)
        step = _solved(normal, gradient[..., None])[..., 0]
        points = points - step
        sizes = np.abs(step).max(axis=1) / (1e-9 + np.abs(points).max(axis=1))
        if not (sizes > _CONVERGED).any():
            break
    normal, _, away, depths = _normal_equations(cameras, pixels, seen, points)
    with np.errstate(invalid="ignore"):
        values = np.linalg.eigvalsh(np.nan_to_num(normal))
        determined = values[:, 0] * _LARGEST_RATIO**2 > values[:, 2]
        ahead = ((depths > 0) | ~seen).all(axis=0)
    good: BoolArray = determined & ahead & np.isfinite(points).all(axis=1) & (seen.sum(axis=0) > 1)
    points = np.where(good[:, None], points, np.nan)
    residuals = np.where(seen & good, np.linalg.norm(away, axis=2), np.nan)
    spread = np.where(
        good[:, None, None], _solved(normal, np.broadcast_to(np.eye(3), normal.shape)), np.nan
    )
    return PointsOfViews(points, residuals, spread)


def _linear(cameras: Sequence[Camera], flat: FloatArray, seen: BoolArray) -> FloatArray:
    """Return the points nearest to the rays, as distances in the planes at depth 1 times depth."""
    normal = np.zeros((flat.shape[1], 3, 3))
    right = np.zeros((flat.shape[1], 3))
    for camera, place, used in zip(cameras, flat, seen, strict=True):
        place = np.where(used[:, None], place, 0.0)
        rows = place[..., None] * camera.rotation[2] - camera.rotation[:2]
        values = camera.translation[:2] - place * camera.translation[2]
        rows *= used[:, None, None]
        normal += np.einsum("nri,nrj->nij", rows, rows)
        right += np.einsum("nri,nr->ni", rows, values)
    return _solved(normal, right[..., None])[..., 0]


def _normal_equations(
    cameras: Sequence[Camera], pixels: FloatArray, seen: BoolArray, points: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return the normal matrix, gradient, distances in the images (C, N, 2), depths (C, N)."""
    normal = np.zeros((len(points), 3, 3))
    gradient = np.zeros((len(points), 3))
    distances, depths = [], []
    for camera, place, used in zip(cameras, pixels, seen, strict=True):
        shown, jacobian, depth = projection_and_jacobian(camera, points)
        away = np.where(used[:, None], shown - place, 0.0)
        jacobian = np.where(used[:, None, None], jacobian, 0.0)
        normal += np.einsum("nri,nrj->nij", jacobian, jacobian)
        gradient += np.einsum("nri,nr->ni", jacobian, away)
        distances.append(away)
        depths.append(depth)
    return normal, gradient, np.stack(distances), np.stack(depths)


def _solved(matrices: FloatArray, right: FloatArray) -> FloatArray:
    """Return the solutions of (N, 3, 3) systems; NaN where one has none."""
    finite: BoolArray = np.asarray(np.isfinite(matrices).all(axis=(1, 2)))
    largest = np.abs(np.where(finite[:, None, None], matrices, 0.0)).max(axis=(1, 2))
    scale = np.where(finite & (largest > 0), largest, 1.0)[:, None, None]
    scaled = matrices / scale
    with np.errstate(invalid="ignore"):
        usable = finite & (np.abs(np.linalg.det(np.nan_to_num(scaled))) > 1e-18)
    safe = np.where(usable[:, None, None], scaled, np.eye(3))
    return np.where(usable[:, None, None], np.linalg.solve(safe, right / scale), np.nan)
