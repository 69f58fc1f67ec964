"""The residual of filmed markers in the image, and the part that poses and weights do not explain.

Estimates of constants of a take (depths, places) come from one least-squares step: the
residual by their columns, with all poses free and the weights under a ridge, since motion that an
expression explains is no evidence of them.

A performer makes a movement in another direction than the character, each time anew, and a head
that nods as it speaks lets that look like depth. `ImageResidual.with_shape_errors` counts such
errors once, as `usdface.retarget.motion_errors` does in space.
"""

from dataclasses import dataclass, replace

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.geometry.rigid_fit import Pose
from usdface.retarget.film.filmed_take import FilmedTake
from usdface.retarget.film.one_camera import PinholeCamera, pose_columns
from usdface.retarget.solver.regularisation import lasting_variance
from usdface.retarget.solver.residual_space import EXPRESSIVE_QUANTILE
from usdface.takes import visible

__all__ = ["ImageResidual", "image_residual"]

# Largest correlation of residuals from frame to frame: at most 200 frames count as one.
_MOST_ALIKE = 0.99
# Least variance, of the mean diagonal of the normal matrices: for their factors alone.
_FINEST = 1e-12
# Frames at a time: the columns of 68 markers have 14 MB.
_BLOCK = 64


@dataclass(frozen=True, eq=False, slots=True)
class ImageResidual:
    """Residuals of M markers in F images, weighted by the certainty of the samples.

    Attributes
    ----------
    left : (F, M, 2) float64 [px]
        0 where occluded.
    slopes : (F, M, 2, 3) float64 [px/m]
        Derivative of the image by positions in head space.
    taken : (F, M, 2, K) float64
        T: T T' maps residuals to the part that poses and weights explain.
    variance : float [px^2]
        Of a coordinate, times the number of frames that count as one.
    noise : float [px^2]
        The part of the variance of a frame that is not correlated in time.
    scale : float [px/m]
    repeated : (F, S) float64, optional
        A: the covariance of a coordinate over the frames is `variance` times I + A A', by errors
        of S blend shapes. I alone, if left out.
    """

    left: FloatArray
    slopes: FloatArray
    taken: FloatArray
    variance: float
    noise: float
    scale: float
    repeated: FloatArray | None = None

    def with_shape_errors(
        self, offsets: FloatArray, weights: FloatArray, moved: FloatArray
    ) -> "ImageResidual":
        """Return the residual with errors of the blend shapes in the ratio of misfit to motion.

        Parameters
        ----------
        offsets : (S, M, 3) float64 [m]
            Of the blend shapes.
        weights : (F, S) float64
            With which the film was solved.
        moved : (F, M, 3) float64 [m]
            Displacements by these weights.
        """
        shown = 2.0 * self.slopes.any(axis=(2, 3)).sum(axis=1)
        free = (shown - (self.taken**2).sum(axis=(1, 2, 3))).clip(min=1.0)
        misfit = _expressive((self.left**2).sum(axis=(1, 2)) / free - self.noise)
        seen = (self.slopes @ moved[..., None])[..., 0]
        motion = _expressive((seen**2).sum(axis=(1, 2)) / shown.clip(min=1.0))
        if misfit <= 0.0 or motion <= 0.0:
            return self
        share = lasting_variance(np.sqrt(misfit)) / motion
        errors = share * self.scale**2 * (offsets**2).mean(axis=(1, 2))
        return replace(self, repeated=weights * np.sqrt(errors / self.variance))

    def equations(self, columns: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return normal matrix (M K, M K) and right-hand side (M K,) without poses and weights.

        Parameters
        ----------
        columns : (F, M, 3, K) float64
            Motion in head space by K parameters of each marker; a first axis of 1 = the same in all
            frames.
        """
        seen = self.slopes @ columns
        count = seen.shape[-1]
        shared = np.einsum("fmki,fmkj->fimj", self.taken, seen, optimize=True)
        shared = shared.reshape(len(seen), self.taken.shape[-1], -1)
        flat = shared.reshape(-1, shared.shape[2])
        normal = -flat.T @ flat
        for k, block in enumerate(np.einsum("fmki,fmkj->mij", seen, seen)):
            own = slice(count * k, count * (k + 1))
            normal[own, own] += block
        explained = np.einsum("fmki,fmk->fi", self.taken, self.left, optimize=True)
        right = np.einsum("fmki,fmk->mi", seen, self.left).ravel()
        right -= np.einsum("fik,fi->k", shared, explained)
        if self.repeated is None:
            return normal, right
        along, rest = self._along_repeated(self.repeated, seen, shared, explained)
        # The inverse covariance, by the matrix inversion lemma; as if poses and weights explained
        # nothing of these errors, which makes them count for somewhat less.
        inner = np.eye(len(along)) + self.repeated.T @ self.repeated
        solved = np.linalg.solve(inner, along.reshape(len(along), -1)).reshape(along.shape)
        normal -= np.tensordot(along, solved, ([0, 1], [0, 1]))
        return normal, right - np.tensordot(solved, rest, ([0, 1], [0, 1]))

    def _along_repeated(
        self, repeated: FloatArray, seen: FloatArray, shared: FloatArray, explained: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return A' times the columns (S, 2 M, M K) and the residual (S, 2 M) without T's part.

        Parameters
        ----------
        repeated : (F, S) float64
        seen : (F, M, 2, K) float64
            The columns of each marker, in the image.
        shared : (F, P, M K) float64
            T' times them.
        explained : (F, P) float64
            T' times the residual.
        """
        count, markers = self.left.shape[:2]
        taken = self.taken.reshape(count, 2 * markers, -1)
        along = np.zeros((repeated.shape[1], 2 * markers, shared.shape[2]))
        for start in range(0, count, _BLOCK):
            block = slice(start, start + _BLOCK)
            along -= np.tensordot(repeated[block].T, taken[block] @ shared[block], 1)
        own = np.einsum("fs,fmki->smki", repeated, seen, optimize=True)
        every = np.arange(markers)
        by_marker = along.reshape(len(along), markers, 2, markers, -1)
        by_marker[:, every, :, every] += own.swapaxes(0, 1)
        rest = self.left.reshape(count, -1) - (taken @ explained[..., None])[..., 0]
        return along, repeated.T @ rest

    def neutral_prior(self, neutral: tuple[int, int]) -> float:
        """Return the prior of `equations` for a coordinate of a resting marker.

        `neutral` are the first and last frame index that it is the mean of.
        """
        first, last = neutral
        noise = max(self.noise, 1e-12 * self.variance)
        return self.scale**2 * (last - first + 1) * self.variance / noise


def image_residual(
    film: FilmedTake,
    camera: PinholeCamera,
    pose: Pose,
    rest: FloatArray,
    moved: FloatArray,
    sure: FloatArray,
    least: float,
) -> ImageResidual:
    """Return the residual of a film as it is solved.

    Parameters
    ----------
    film : FilmedTake
    camera : PinholeCamera
    pose : Pose
        Of the head in camera space.
    rest : (M, 3) float64 [m]
        The markers where they rest.
    moved : (F, M, 3) float64 [m]
        Their displacements by the weights.
    sure : (F, M) float64
        As of `usdface.retarget.film.filmed_head.certainty`.
    least : float [m]
        Least deviation of a coordinate.
    """
    known = (visible(film.image) * sure)[..., None]
    placed = pose.to_take(rest + moved)
    left = np.where(known > 0.0, film.image - camera.image(placed), 0.0) * known
    slopes = camera.slopes(placed) @ pose.rotations[:, None] * known[..., None]
    # The residual is correlated in time, so there are fewer independent frames.
    alike = float((left[1:] * left[:-1]).sum() / max((left**2).sum(), 1e-300))
    lasting = (1.0 + alike) / (1.0 - min(alike, _MOST_ALIKE))
    scale = camera.focal_length / -float(np.median(pose.translations[:, 2]))
    frame_variance = max(_mean_square(left, known), (least * scale) ** 2)
    poses = pose_columns(rest + moved, pose, camera) * known[..., None]
    taken = _explained(poses, slopes @ film.moving.offsets.transpose(1, 2, 0), frame_variance)
    both = (known[1:] > 0.0) & (known[:-1] > 0.0)
    noise = _mean_square(np.where(both, np.diff(left, axis=0), 0.0), both) / 2.0
    return ImageResidual(left, slopes, taken, lasting * frame_variance, noise, scale)


def _explained(poses: FloatArray, shapes: FloatArray, variance: float) -> FloatArray:
    """Return T: T T' maps residuals to the part that poses and weights of about 1 explain.

    Priors: deviations of a radian or a metre for a pose, and of 1 for a weight.

    Parameters
    ----------
    poses : (F, M, 2, 6) float64 [px]
    shapes : (F, M, 2, S) float64 [px]
    variance : float [px^2]
        Of a coordinate in a frame.

    Returns
    -------
    (F, M, 2, 6 + S) float64
    """
    both = np.concatenate([poses, shapes], axis=-1)
    flat = both.reshape(len(both), -1, both.shape[-1])
    normal = flat.transpose(0, 2, 1) @ flat
    # A film that is explained without a residual still has a definite normal matrix.
    variance = max(variance, _FINEST * float(np.einsum("fii->fi", normal).mean()))
    half = np.linalg.cholesky(normal + variance * np.eye(both.shape[-1]))
    taken = np.linalg.solve(half, flat.transpose(0, 2, 1)).transpose(0, 2, 1)
    return np.asarray(taken.reshape(both.shape))


def _mean_square(values: FloatArray, is_visible: FloatArray | BoolArray) -> float:
    """Return the mean square of the visible (F, M, 1) coordinates (F, M, 2)."""
    return float((values**2).sum() / (2 * max((is_visible > 0.0).sum(), 1)))


def _expressive(squares: FloatArray) -> float:
    """Return the mean square of a coordinate in an expressive frame, by those of all (F,)."""
    return float(np.quantile(squares, EXPRESSIVE_QUANTILE))
