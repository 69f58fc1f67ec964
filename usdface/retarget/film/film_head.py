"""The head motion in a take of one camera, solved together with the weights.

An image has no depth, but the character does: its neutral and its blend shapes give every marker a
third coordinate. With it the head pose is fitted by a perspective camera, and the weights are
solved in the view of each image (`usdface.retarget.film.projected_weights`). Poses, and the offset
of a dot's centre from the mean of its skin, depend on the weights, so they are solved alternately.
Where the head turns, the depths of the performer's own face are estimated, too, and then the places
of the markers on the skin.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.face.dot_skin import DotSkin
from usdface.face.marker_surface import MarkerSurface
from usdface.findings import Finding, finding
from usdface.geometry.rigid_fit import Pose
from usdface.retarget.film.dot_centres import dot_centre_offsets, foreshortening
from usdface.retarget.film.filmed_depths import refined_depths
from usdface.retarget.film.filmed_head import FilmedHead, certainty
from usdface.retarget.film.filmed_places import refined_shifts
from usdface.retarget.film.filmed_take import FilmedTake
from usdface.retarget.film.one_camera import PinholeCamera, fit_pose, start_pose
from usdface.retarget.film.views import Views
from usdface.retarget.neutral import neutral_markers
from usdface.retarget.places import guess_in_image
from usdface.takes import MarkerTake, visible

__all__ = ["SolveProjected", "film_head"]

# Alternations of poses and weights, at most; and the change of markers, by their residual, at which
# they stop: later rounds change weights by less than their error.
_ROUNDS = 10
_SETTLED = 0.05
# Rounds over all frames, started from the displacements of a sample.
_LAST_ROUNDS = 3
# Frames sampled for the depths: a bound on time.
_FRAMES = 600
# Least number of markers, for the six parameters of a pose and a face.
_FEWEST = 6
# Assumed diagonal of an image of unknown size, by the face's size in it.
_AROUND = 4.0
# Focal lengths that are tried, in diagonals of the image: 22 to 170 mm on 35 mm film;
# between them a parabola in the logarithm is fitted. Rounds and frames of each trial.
_FOCAL_LENGTHS = np.array([0.5, 0.8, 1.25, 2.0, 4.0])
_TRIAL_ROUNDS = 3
_TRIAL_FRAMES = 200
# Focal length where the take does not determine it, and it hardly matters: 28 mm on 35 mm film, as
# of phones.
_USUAL = 0.65
# The focal length counts as determined where the largest residual of those tried is this many times
# the least. Of six films of another performer (python -m benchmarks.one_camera) the three below
# were found 1.4 to 4.5 times too long, the three above at most 1.3 times: the misfit of another
# face resembles a lens error.
_SHOWN = 1.2

# Times that places are refined, at most, and the alternations after each.
_PLACE_STEPS = 6
_PLACE_ROUNDS = 3
# Places are refined again where the last step left a hundredth less of the take, at least.
_LOWER = 0.01
# Markers are on their vertices if they err by less than this share of the face's size at rest.
_EXACT = 1e-6

# Solves the weights (F, S) of a take as the camera projects it, by the skin under all bound
# markers, its views and neutral frames.
SolveProjected = Callable[[DotSkin, MarkerTake, Views, tuple[int, int]], FloatArray]
_Solve = Callable[[MarkerTake, Views, tuple[int, int]], FloatArray]


def film_head(
    take: MarkerTake,
    markers: tuple[str, ...],
    surface: MarkerSurface,
    neutral: tuple[int, int],
    solve: SolveProjected,
    *,
    refined: bool = True,
) -> tuple[FilmedHead | None, list[Finding]]:
    """Find how a head moved before the camera that filmed it.

    Parameters
    ----------
    take : MarkerTake
        2D.
    markers : tuple of str, length B
        The bound markers.
    surface : MarkerSurface
        Of the character around each of them.
    neutral : (int, int)
        First and last neutral frame index, inclusive.
    solve : callable
        Solves a take of a still head with these neutral frames, for weights of the skin's
        evaluator.
    refined : bool
        Markers may sit beside their vertices.

    Returns
    -------
    FilmedHead or None
        None where fewer than six markers are in the take and its neutral frames.
    list of Finding
    """
    known = [k for k, name in enumerate(markers) if name in take.names]
    image = take.select(tuple(markers[k] for k in known))
    rest = neutral_markers(image, neutral)
    used = np.flatnonzero(visible(rest) & visible(image).any(axis=0))
    if len(used) < _FEWEST:
        return None, []
    bound = np.array(known)[used]
    own = np.array([take.names.index(markers[k]) for k in bound.tolist()])
    film = FilmedTake(take.with_markers(own), surface.skin.select(bound), neutral)
    camera, findings = _camera(film, partial(solve, surface.skin))
    part, skin = film.part(_FRAMES), surface.skin
    head, weights, left = _in_turn(part, camera, partial(solve, skin), _ROUNDS)
    if refined:
        head, weights, skin = _with_places(part, surface, bound, solve, (head, weights, left))
    if len(part.image) == len(film.image):
        return head, findings
    film = replace(film, skin=skin.select(bound))
    there = _at_times(weights, part.take.times, film.take.times)
    last, _, _ = _in_turn(
        film, camera, partial(solve, skin), _LAST_ROUNDS, head.rest[:, 2], there, refined=False
    )
    return replace(last, shifts=head.shifts), findings


def _with_places(
    film: FilmedTake,
    surface: MarkerSurface,
    bound: IntArray,
    solve: SolveProjected,
    solved: tuple[FilmedHead, FloatArray, float],
) -> tuple[FilmedHead, FloatArray, DotSkin]:
    """Return head and weights by places that leave less of the take, and the skin there.

    Parameters
    ----------
    film : FilmedTake
    surface : MarkerSurface
        Around all bound markers.
    bound : (M,) int64
        Those of the film.
    solve : callable
    solved : (FilmedHead, (F, S) float64, float)
        Head, weights and residual with the markers on their vertices.
    """
    head, weights, left = solved
    guess = guess_in_image(head.rest[:, :2], film.face)
    skin, own = surface.skin, surface.select(bound)
    shifts = np.zeros((len(surface.vertices), 3))
    if guess.spread <= _EXACT * surface.reach:
        return replace(head, shifts=shifts), weights, skin
    for _ in range(_PLACE_STEPS):
        placed = own.at(shifts[bound])
        there = shifts.copy()
        there[bound] = refined_shifts(film, head, weights, shifts[bound], placed, guess, own)
        moved = surface.at(there).skin
        film = replace(film, skin=moved.select(bound))
        again = _in_turn(
            film, head.camera, partial(solve, moved), _PLACE_ROUNDS, head.rest[:, 2], weights
        )
        before = left
        if again[2] < before:
            (head, weights, left), shifts, skin = again, there, moved
        if again[2] > (1.0 - _LOWER) * before:
            break
    return replace(head, shifts=shifts), weights, skin


def _camera(film: FilmedTake, solve: _Solve) -> tuple[PinholeCamera, list[Finding]]:
    """Return the camera, by the take's focal length or by one estimated from its motion."""
    take, findings = film.take, list[Finding]()
    if take.image_size:
        diagonal = float(np.hypot(*take.image_size))
        centre = 0.5 * np.array(take.image_size) * [1.0, -1.0]
    else:
        diagonal = _AROUND * float(np.linalg.norm(np.ptp(film.rest, axis=0)))
        centre = film.rest.mean(axis=0)
        findings.append(finding("IMAGE_SIZE_ASSUMED", take.source))
    if take.focal_length:
        return PinholeCamera(take.focal_length, centre), findings
    some = film.part(_TRIAL_FRAMES)
    lengths = _FOCAL_LENGTHS * diagonal
    errors = np.array(
        [
            _in_turn(some, PinholeCamera(length, centre), solve, _TRIAL_ROUNDS)[2]
            for length in lengths
        ]
    )
    determined = bool(errors.max() > _SHOWN * errors.min())
    length = _lowest(lengths, errors) if determined else _USUAL * diagonal
    code = "FOCAL_LENGTH_FOUND" if determined else "FOCAL_LENGTH_ASSUMED"
    findings.append(finding(code, take.source, "{focal_length_px:.0f} px", length))
    return PinholeCamera(length, centre), findings


def _lowest(lengths: FloatArray, errors: FloatArray) -> float:
    """Return the minimum of a parabola through the least error and its neighbours."""
    middle = int(np.clip(errors.argmin(), 1, len(errors) - 2))
    around = slice(middle - 1, middle + 2)
    places = np.log(lengths[around])
    bend, slope, _ = np.polyfit(places, np.log(errors[around]), 2)
    if bend <= 0.0:
        return float(lengths[errors.argmin()])
    return float(np.exp(np.clip(-0.5 * slope / bend, places[0], places[-1])))


def _in_turn(
    film: FilmedTake,
    camera: PinholeCamera,
    solve: _Solve,
    rounds: int,
    depths: FloatArray | None = None,
    weights: FloatArray | None = None,
    *,
    refined: bool = True,
) -> tuple[FilmedHead, FloatArray, float]:
    """Solve poses and weights alternately.

    Parameters
    ----------
    depths : (M,) float64 [m], optional
        Of the resting markers, a first guess; else those of the character.
    weights : (F, S) float64, optional
        A first guess.
    refined : bool
        Depths are refined.

    Returns
    -------
    head : FilmedHead
    weights : (F, S) float64
    left : float [px]
        RMS residual in the image.
    """
    filmed, skin, count = film, film.skin, len(film.image)
    look = start_pose(film.face, film.rest[None], camera)
    look, _ = fit_pose(film.face, film.rest[None], camera, look)
    deep = film.face[:, 2] if depths is None else depths
    weights_known = weights is not None
    if weights is None:
        weights = np.zeros((count, len(skin.evaluator.offsets)))
    pose = Pose(np.repeat(look.rotations, count, 0), np.repeat(look.translations, count, 0))
    before = np.zeros(0)
    for done in range(rounds):
        moved = film.moved(weights)
        beside = dot_centre_offsets(skin, weights, pose, camera)
        facing = foreshortening(skin, weights, pose, camera)
        sure = certainty(facing, visible(film.image))
        film = filmed.without(beside)
        look, _ = fit_pose(film.face, film.rest[None], camera, look)
        rest = camera.at_depths(film.rest[None], look, deep)[0]
        pose, _ = fit_pose(rest + moved, film.image, camera, pose, sure)
        if refined and (done > 0 or weights_known):
            deep = refined_depths(film, camera, look, pose, rest, moved, sure)
            rest = camera.at_depths(film.rest[None], look, deep)[0]
            pose, _ = fit_pose(rest + moved, film.image, camera, pose, sure)
        head = FilmedHead(
            film.take.names, camera, pose, rest, moved, look, beside, facing, np.zeros_like(rest)
        )
        left = _rms(film.image - camera.image(pose.to_take(rest + moved)))
        still = head.still(filmed.take).positions
        if done > 1 and _rms(still - before) < _SETTLED * left / head.metre:
            break
        before = still
        if done < rounds - 1:
            weights = solve(*head.projected(filmed.take), film.neutral)
    return head, weights, left


def _at_times(values: FloatArray, known: FloatArray, times: FloatArray) -> FloatArray:
    """Return values (K, S) at `known` times (K,) at other times (F,): (F, S)."""
    return np.stack([np.interp(times, known, column) for column in values.T], axis=1)


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.nanmean(values**2)))
