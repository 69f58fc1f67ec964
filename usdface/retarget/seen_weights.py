"""Weights of a head that turns before a camera: what each image shows is solved as it shows it.

Displacements D w of the markers in head space are seen as V_t D w, with V_t the camera's view of
every marker in frame t (`usdface.retarget.views`): of a head that looks aside an image shows how
far lips come forward, of one that looks at the camera it does not. The least squares of
`usdface.retarget.solve` are therefore those of each frame's own matrix V_t D, without what the
head's small motions H_t look like::

    min over 0 <= w <= 1 of   sum_t |(1 - P_t) C_t (V_t D w_t - y_t)|^2 / 2 + the terms

with C_t the samples' certainty and P_t the projector on C_t H_t. Hidden markers have none. Blend
shapes with inbetweens or combinations are solved in Gauss-Newton steps.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.special import chdtri

from usdface.arrays import FloatArray
from usdface.blend_shape_evaluator import BlendShapeEvaluator
from usdface.frame_blocks import by_blocks
from usdface.geometry.marker_spread import rms_radius
from usdface.geometry.rigid_fit import Pose
from usdface.geometry.rigid_modes import motion_basis
from usdface.retarget.bounds import Bounds
from usdface.retarget.frame_normals import solve_by_frame
from usdface.retarget.noise import MOST, typical_deviation
from usdface.retarget.pins import pin_bounds
from usdface.retarget.pose_and_weights import PoseAndWeights
from usdface.retarget.rbf import SpaceMap
from usdface.retarget.regularisation import Regularisation
from usdface.retarget.solve import FEWEST_FRAMES, Iterate, with_learned_covariance
from usdface.retarget.terms import roughness
from usdface.retarget.views import Views
from usdface.retarget_setup import RetargetSetup
from usdface.takes import visible

__all__ = ["solve_seen_weights"]

# Gauss-Newton steps of rigs with inbetweens or combinations, and halvings of one. Set by hand.
_STEPS, _HALVINGS = 12, 5
# Iterations, of those of a solve with one matrix for all frames, that a learned covariance asks for
# (`usdface.retarget.solve`); and those of a solve that the covariance is learned from.
_LONGER, _ROUGH = 1.3, 30
# A ridge that tells rounding from a direction, of the mean diagonal entry; singular values below
# its root explain nothing.
_ROUNDING = 1e-10
# What filmed dots err over what is known of it: errors that last (compression, slant, shading) are
# not in the deviation of a take, and are no difference of face and rig. RMS errors about their mean
# are 1.07 to 1.31 of the stated deviation (six films before a phone).
_LASTING = 1.3
# Coordinates of which the shapes explain all but this share say nothing of noise.
_LEFT = 0.05


def solve_seen_weights(
    times: FloatArray,
    positions: FloatArray,
    target: FloatArray,
    model: BlendShapeEvaluator,
    space: SpaceMap,
    pose: Pose,
    setup: RetargetSetup,
    names: tuple[str, ...],
    views: Views,
    *,
    least_noise: float = 0.0,
) -> PoseAndWeights:
    """Solve the weights of a head as a camera sees it.

    Parameters
    ----------
    times : (F,) float64 [s]
    positions : (F, M, 2) float64
        Rest places of the performer's markers plus how far they are seen to move; NaN where hidden.
    target : (M, 3) float64 [m]
        Neutral feature points on the character.
    model : BlendShapeEvaluator
        Of their displacements by the blend shapes: S shapes, 3 M coordinates.
    space : SpaceMap
        From the performer's neutral to `target`.
    pose : Pose
        Returned as it is.
    setup : RetargetSetup
    names : tuple of str, length S
    views : Views
        Of these M markers in these frames.
    least_noise : float [m]
        Standard deviation of a marker coordinate, as far as it is known before.
    """
    seen = visible(positions)
    observed = np.nan_to_num(space.displacements(positions)[..., :2]).reshape(len(times), -1)
    moving = setup.head == "solve"
    film = _SeenTake(model, views.where(seen), observed, target, moving)
    noise = max(film.noise(), least_noise)
    regularisation = Regularisation(
        noise,
        film.misfit(noise),
        setup.solve,
        tuple(names[shape] for shape in model.free),
        size=rms_radius(target),
    )
    weights, regularisation = _solved(film, times, regularisation, setup, model)
    moved = model.displacements(weights)
    left = (observed - film.views.seen(moved)).reshape(*seen.shape, 2)
    displaced = moved.reshape(*seen.shape, 3) + (left[:, :, None] @ views.slopes)[:, :, 0]
    displaced = np.where(seen[..., None], displaced, np.nan)
    return PoseAndWeights(weights, pose, displaced, regularisation, 1, space)


@dataclass(frozen=True, eq=False)
class _SeenTake:
    """Displacements as they are seen, and the shapes that explain them.

    Attributes
    ----------
    model : BlendShapeEvaluator
    views : Views
        Certain of nothing where a marker is hidden.
    observed : (F, 2 M) float64 [m]
    target : (M, 3) float64 [m]
    moving : bool
        The head's small motions are left out.
    """

    model: BlendShapeEvaluator
    views: Views
    observed: FloatArray
    target: FloatArray
    moving: bool

    @cached_property
    def turns(self) -> FloatArray:
        """Orthonormal small motions of the head as they are seen: (F, 2 M, 6 or 0)."""
        count = len(self.observed)
        if not self.moving:
            return np.zeros((count, self.observed.shape[1], 0))
        basis = np.broadcast_to(motion_basis(self.target, 3).T, (count, 6, self.target.size))
        seen = self.views.weighed(self.views.seen(basis)).transpose(0, 2, 1)
        return np.asarray(np.linalg.qr(seen)[0])

    def left(self, weights: FloatArray) -> FloatArray:
        """Return what complete weights (F, S) leave: (F, 2 M) [m]."""
        seen = self.views.seen(self.model.displacements(weights))
        return self._still(self.views.weighed(self.observed - seen))

    def _still(self, values: FloatArray) -> FloatArray:
        turned = self.turns.transpose(0, 2, 1) @ values[..., None]
        return np.asarray(values - (self.turns @ turned)[..., 0])

    def equations(self, free: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return normal matrices (F, P, P) and right-hand sides (F, P) about weights (F, P)."""
        count = free.shape[1]

        def both(block: slice) -> FloatArray:
            full = self.model.complete(free[block])
            slopes = self._directions(self.model.secants(full, full), block)
            normal = slopes @ slopes.transpose(0, 2, 1)
            right = (slopes @ left[block][..., None])[..., 0]
            right += (normal @ free[block][..., None])[..., 0]
            return np.concatenate([normal, right[:, None]], axis=1)

        left = self.left(self.model.complete(free))
        found = by_blocks(len(free), both)
        return found[:, :count], found[:, count]

    def _directions(self, displacements: FloatArray, block: slice) -> FloatArray:
        """Return displacements (F, K, 3 M) as they are seen, the head still: (F, K, 2 M)."""
        views, turns = self.views.at(block), self.turns[block]
        seen = views.weighed(views.seen(displacements))
        return np.asarray(seen - (seen @ turns) @ turns.transpose(0, 2, 1))

    @cached_property
    def unexplained(self) -> tuple[FloatArray, FloatArray]:
        """What no weights and no motion explain (F, 2 M) [m], and how much of it shows (F, 2 M)."""
        directions = self.model.directions
        values = self._still(self.views.weighed(self.observed))

        def rest(block: slice) -> FloatArray:
            views, own = self.views.at(block), values[block]
            everywhere = np.broadcast_to(directions, (len(own), *directions.shape))
            seen = self._directions(everywhere, block)
            normal = seen @ seen.transpose(0, 2, 1)
            size = np.trace(normal, axis1=1, axis2=2)[:, None, None] / len(directions)
            normal += (_ROUNDING * size + 1e-300) * np.eye(len(directions))
            solved = np.linalg.solve(normal, seen)
            along = (seen @ own[..., None])[..., 0]
            share = (np.repeat(views.certainty, 2, axis=1) > 0.0) - (seen * solved).sum(axis=1)
            share = (share - (self.turns[block] ** 2).sum(axis=2)).clip(0.0, 1.0)
            return np.stack([own - (along[:, None] @ solved)[:, 0], share], axis=1)

        found = by_blocks(len(self.observed), rest)
        return found[:, 0], found[:, 1]

    def noise(self) -> float:
        """Estimate the white noise of coordinates by third differences in time [m]."""
        left, share = self.unexplained
        if len(left) < 4:
            return 0.0
        four = np.lib.stride_tricks.sliding_window_view(share, 4, axis=0)
        shown = four.min(axis=-1) > _LEFT
        third = np.diff(left, 3, axis=0)[shown] / np.sqrt(four.mean(axis=-1)[shown])
        return typical_deviation(third)

    def misfit(self, noise: float) -> float:
        """Estimate the difference of face and rig [m], as `usdface.retarget.noise` does."""
        left, share = self.unexplained
        count = share.sum(axis=1)
        enough = count > 1.0
        if not enough.any():
            return 0.0
        squares, count = (left[enough] ** 2).sum(axis=1) / count[enough], count[enough]
        excess = squares - (_LASTING * noise) ** 2 * chdtri(count, 1.0 - MOST) / count
        return float(np.sqrt(max(0.0, float(np.quantile(excess, MOST)))))


def _solved(
    film: _SeenTake,
    times: FloatArray,
    regularisation: Regularisation,
    setup: RetargetSetup,
    model: BlendShapeEvaluator,
) -> tuple[FloatArray, Regularisation]:
    """Return complete weights (F, S), and the regularisation with the covariance that was learned."""
    rows = model.limit_rows
    bounds = Bounds(rows=rows, limits=np.zeros(len(rows)))
    start = Iterate(np.zeros((len(times), len(model.free))))
    if model.linear:
        normals, right = film.equations(start.weights)
        start = _step(normals, right, times, regularisation, bounds, None)
    else:
        start = _gauss_newton(film, times, regularisation, bounds, start)
    if setup.pins:
        free = tuple(regularisation.names)
        bounds = pin_bounds(setup.pins, free, times, start.weights, rows)
        if model.linear:
            start = _step(normals, right, times, regularisation, bounds, start)
        else:
            start = _gauss_newton(film, times, regularisation, bounds, start)
    return model.complete(start.weights), regularisation


def _step(
    normals: FloatArray,
    right: FloatArray,
    times: FloatArray,
    regularisation: Regularisation,
    bounds: Bounds,
    start: Iterate | None,
    iterations: int | None = None,
) -> Iterate:
    """Solve for the free weights of all frames."""
    options, size = regularisation.options, right.shape[1]
    floor = _ROUNDING * max(float(np.trace(normals.mean(axis=0))) / size, 1e-300)
    terms = regularisation.added_to(np.zeros((size, size))) + floor * np.eye(size)
    bands = regularisation.bands(times)
    if options.mode == "frame":
        bands = np.zeros_like(bands)
    count = iterations or int(np.ceil(_LONGER * options.iterations))
    covariance = regularisation.covariance
    pulled = regularisation.pulled(right)
    return solve_by_frame(
        normals + terms, pulled, bands, bounds, start, count, options.tolerance, covariance
    )


def _gauss_newton(
    film: _SeenTake,
    times: FloatArray,
    regularisation: Regularisation,
    bounds: Bounds,
    start: Iterate,
) -> Iterate:
    """Solve for the free weights of shapes whose paths bend."""
    bands = regularisation.bands(times)

    def cost(free: FloatArray) -> float:
        left = film.left(film.model.complete(free))
        own = 0.5 * float((left**2).sum()) + float(regularisation.value(free).sum())
        return own + 0.5 * roughness(bands, free)

    low, high = bounds.over(*start.weights.shape)
    here = replace(start, weights=np.clip(start.weights, low, high))
    value = cost(here.weights)
    for number in range(_STEPS):
        normals, right = film.equations(here.weights)
        found = _step(normals, right, times, regularisation, bounds, here)
        step = found.weights - here.weights
        size = 1.0
        # The first step may have to leave bounds that its start broke.
        for _ in range(_HALVINGS if number else 0):
            if cost(here.weights + size * step) <= value:
                break
            size *= 0.5
        here = replace(found, weights=here.weights + size * step)
        value = cost(here.weights)
        if size * float(np.abs(step).max(initial=0.0)) < regularisation.options.tolerance:
            break
    return here
