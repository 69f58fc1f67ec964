"""The head motion in a take of one camera, solved together with the weights.

An image has no depth, but the character does: its neutral and its blend shapes give every marker a
third coordinate. With it the head pose is fitted by a perspective camera, and the weights are
solved in the view of each image (`usdface.retarget.film.projected_weights`). Poses, and the offset
of a dot's centre from the mean of its skin, depend on the weights, so they are solved alternately.
Where the head turns, the depths of the performer's own face are estimated, too.
"""

from collections.abc import Callable

import numpy as np

from usdface.arrays import FloatArray
from usdface.face.dot_skin import DotSkin
from usdface.findings import Finding, finding
from usdface.geometry.rigid_fit import Pose
from usdface.retarget.film.dot_centres import dot_centre_offsets, foreshortening
from usdface.retarget.film.filmed_depths import refined_depths
from usdface.retarget.film.filmed_head import FilmedHead, certainty
from usdface.retarget.film.filmed_take import FilmedTake
from usdface.retarget.film.one_camera import PinholeCamera, fit_pose, start_pose
from usdface.retarget.film.views import Views
from usdface.retarget.neutral import neutral_markers
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

# Solves the weights (F, S) of a take as the camera projects it, by its views and neutral frames.
SolveProjected = Callable[[MarkerTake, Views, tuple[int, int]], FloatArray]


def film_head(
    take: MarkerTake,
    markers: tuple[str, ...],
    skin: DotSkin,
    neutral: tuple[int, int],
    solve: SolveProjected,
) -> tuple[FilmedHead | None, list[Finding]]:
    """Find how a head moved before the camera that filmed it.

    Parameters
    ----------
    take : MarkerTake
        2D.
    markers : tuple of str, length B
        The bound markers.
    skin : DotSkin
        Of the character under each of them.
    neutral : (int, int)
        First and last neutral frame index, inclusive.
    solve : callable
        Solves a take of a still head with these neutral frames, for weights of `skin.evaluator`.

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
    film = FilmedTake(take.with_markers(own), skin.select(bound), neutral)
    camera, findings = _camera(film, solve)
    some = film.part(_FRAMES)
    head, weights, _ = _in_turn(some, camera, solve, _ROUNDS)
    if len(some.image) == len(film.image):
        return head, findings
    there = _at_times(weights, some.take.times, film.take.times)
    return _in_turn(film, camera, solve, _LAST_ROUNDS, head.rest[:, 2], there)[0], findings


def _camera(film: FilmedTake, solve: SolveProjected) -> tuple[PinholeCamera, list[Finding]]:
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
    solve: SolveProjected,
    rounds: int,
    depths: FloatArray | None = None,
    weights: FloatArray | None = None,
) -> tuple[FilmedHead, FloatArray, float]:
    """Solve poses and weights alternately.

    Parameters
    ----------
    depths : (M,) float64 [m], optional
        Of the resting markers, where they are known.
    weights : (F, S) float64, optional
        A first guess.

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
        if depths is None and done > 0:
            deep = refined_depths(film, camera, look, pose, rest, moved, sure)
            rest = camera.at_depths(film.rest[None], look, deep)[0]
            pose, _ = fit_pose(rest + moved, film.image, camera, pose, sure)
        head = FilmedHead(film.take.names, camera, pose, rest, moved, look, beside, facing)
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
