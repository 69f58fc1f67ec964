"""A film solved with markers at given places: head poses, depths and weights alternately.

Poses, and the offset of a dot's centre from the mean of its skin, depend on the weights, and the
weights are solved in the view of each image (`usdface.retarget.film.projected_weights`).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from usdface.arrays import FloatArray
from usdface.face.dot_skin import DotSkin
from usdface.geometry.rigid_fit import Pose
from usdface.numerics.rms import rms
from usdface.retarget.film.aligned_head import aligned_head
from usdface.retarget.film.dot_centres import dot_centre_offsets, foreshortening
from usdface.retarget.film.filmed_depths import refined_depths
from usdface.retarget.film.filmed_head import FilmedHead, certainty
from usdface.retarget.film.filmed_take import FilmedTake
from usdface.retarget.film.one_camera import PinholeCamera, fit_pose, start_pose
from usdface.retarget.film.views import Views
from usdface.takes import MarkerTake, visible

__all__ = ["SolveOnSkin", "SolveProjected", "SolvedFilm", "solve_film"]

# Change of markers, by their residual, at which the rounds end: later ones change weights by less
# than their error.
_SETTLED = 0.05

# Solves the weights (F, S) of a take as the camera projects it, by its views and neutral frames.
SolveProjected = Callable[[MarkerTake, Views, tuple[int, int]], FloatArray]
# The same by the skin under all bound markers.
SolveOnSkin = Callable[[DotSkin, MarkerTake, Views, tuple[int, int]], FloatArray]


@dataclass(frozen=True, eq=False, slots=True)
class SolvedFilm:
    """A film and its solution.

    Attributes
    ----------
    film : FilmedTake
    head : FilmedHead
    weights : (F, S) float64
    left : float [px]
        RMS residual in the image, by the errors of the markers.
    """

    film: FilmedTake
    head: FilmedHead
    weights: FloatArray
    left: float

    @property
    def depths(self) -> FloatArray:
        """Of the resting markers: (M,) [m]."""
        return self.head.rest[:, 2]

    def weights_at(self, times: FloatArray) -> FloatArray:
        """Return the weights at other times (T,) [s]: (T, S)."""
        known = self.film.take.times
        return np.stack([np.interp(times, known, column) for column in self.weights.T], axis=1)


def solve_film(
    film: FilmedTake,
    camera: PinholeCamera,
    solve: SolveProjected,
    rounds: int,
    start: SolvedFilm | None = None,
    *,
    errors: FloatArray | None = None,
    refined: bool = True,
) -> SolvedFilm:
    """Solve poses and weights alternately.

    Parameters
    ----------
    film : FilmedTake
    camera : PinholeCamera
    solve : callable
    rounds : int
        At most.
    start : SolvedFilm, optional
        Of these markers in some of the frames, a first guess; else the character at rest.
    errors : (M,) float64 [1], optional
        Of the markers; equal, if left out.
    refined : bool
        Depths are refined where weights are known.
    """
    filmed, skin, count = film, film.moving, len(film.image)
    errors = np.ones(len(film.face)) if errors is None else errors
    if start is None:
        look = start_pose(film.face, film.rest[None], camera)
        look = fit_pose(film.face, film.rest[None], camera, look)
        deep, weights = film.face[:, 2], np.zeros((count, len(skin.evaluator.offsets)))
    else:
        look, deep = start.head.rest_pose, start.depths
        weights = start.weights_at(film.take.times)
    pose = Pose(np.repeat(look.rotations, count, 0), np.repeat(look.translations, count, 0))
    before = np.zeros(0)
    for done in range(rounds):
        moved = film.moved(weights)
        beside = dot_centre_offsets(skin, weights, pose, camera)
        facing = foreshortening(skin, weights, pose, camera)
        sure = certainty(facing, visible(film.image), errors)
        film = filmed.without(beside)
        if start is None and done == 0:
            look = fit_pose(film.face, film.rest[None], camera, look)
        rest = camera.at_depths(film.rest[None], look, deep)[0]
        pose = fit_pose(rest + moved, film.image, camera, pose, sure)
        if refined and (done > 0 or start is not None):
            deep, deviation = refined_depths(film, camera, look, pose, rest, weights, sure)
            rest = camera.at_depths(film.rest[None], look, deep)[0]
            look, pose, rest = aligned_head(look, pose, rest, film.face, deviation)
            deep = rest[:, 2]
            pose = fit_pose(rest + moved, film.image, camera, pose, sure)
        head = FilmedHead(
            markers=film.take.names,
            camera=camera,
            pose=pose,
            rest=rest,
            moved=moved,
            rest_pose=look,
            beside=beside,
            facing=facing,
            errors=errors,
            mapped=filmed.mapped,
        )
        left = rms((film.image - camera.image(pose.to_take(rest + moved))) / errors[:, None])
        still = head.still(filmed.take).positions
        if done > 1 and rms(still - before) < _SETTLED * left / head.metre:
            break
        before = still
        if done < rounds - 1:
            weights = solve(*head.projected(filmed.take), film.neutral)
    return SolvedFilm(filmed, head, weights, left)
