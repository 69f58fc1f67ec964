"""A head that one camera films: its pose in space, and its markers as if it had not moved.

An image says nothing of depth, but the character does: on its resting face and its blend shapes
every marker has a third coordinate. With it the pose of the head is that of a perspective camera,
and a marker's other two coordinates are where its ray meets that depth. The depth depends on the
weights, so poses and weights are found in turn. Where the head turns, the image also tells how deep
the performer's own face is. Of a painted dot the camera shows the middle of what faces it; how far
this lies beside the mean of the skin under the dot, weights and pose tell, too.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from usdface.arrays import FloatArray
from usdface.face.dot_skin import DotSkin
from usdface.findings import Finding, finding
from usdface.geometry.marker_spread import rms_radius
from usdface.geometry.rigid_fit import Pose
from usdface.retarget.dot_centres import beside_means
from usdface.retarget.neutral import neutral_markers
from usdface.retarget.one_camera import PinholeCamera, fit_pose, pose_columns, start_pose
from usdface.takes import MarkerTake, visible

__all__ = ["FilmedHead", "SolveStill", "film_head"]

# Poses and weights in turn, at most; and the change of markers, by their residual, at which they
# end: later rounds change weights by less than their error.
_ROUNDS = 8
_SETTLED = 0.05
# Rounds of all frames, from the displacements of some.
_LAST_ROUNDS = 3
# Frames that depths and the focal length are looked for in: a bound on time.
_FRAMES = 600
# Markers for six numbers of a pose and a face.
_FEWEST = 6
# Of what is left from frame to frame: at most 200 frames count as one.
_MOST_ALIKE = 0.99
# Where the image's size is unknown, of the face's size in it.
_AROUND = 4.0
# Standard deviation of a marker's depth between two people, of the face's size: 4 mm, as between
# the faces of the ICT model (identity modes).
_DEPTH_SPREAD = 0.08
# Least deviation of what poses and weights leave, of the face's size. What the pose takes of an
# expression turns a head that rests; where hardly anything is left of the image these turns would
# tell depths. By 0.003, 0.01 and 0.03 a filmed head at rest (10 s by a phone, the recorded curves
# from 100 s on) has weights that are off by 0.108, 0.095 and 0.095, without it by 0.110.
_MISFIT = 0.01
# Focal lengths that are tried, of the image's diagonal: 22 to 170 mm on 35 mm film. In between, a
# parabola in the logarithm; and the rounds of each trial.
_FOCAL_LENGTHS = np.array([0.5, 0.8, 1.25, 2.0, 4.0])
_TRIAL_ROUNDS = 3
_TRIAL_FRAMES = 200
# Taken where the take does not show it, and where it hardly matters: 28 mm on 35 mm film, as phones
# film.
_USUAL = 0.65
# The focal length counts as shown where the worst of those tried leaves so much more. Set by hand.
_SHOWN = 1.1

# The weights (F, S) that are solved for a take of a still head, given its neutral frames.
SolveStill = Callable[[MarkerTake, tuple[int, int]], FloatArray]


@dataclass(frozen=True, eq=False, slots=True)
class FilmedHead:
    """How a head moved before the camera.

    Attributes
    ----------
    markers : tuple of str, length M
    camera : PinholeCamera
    pose : Pose
        Of the head in camera space. Head space is that of the character at rest.
    depths : (F, M) float64 [m]
        Third coordinates of the markers, in head space.
    rest : (M, 3) float64 [m]
        The resting markers, in head space.
    rest_pose : Pose
        Of one frame, the neutral.
    beside : (F, M, 2) float64 [px]
        From the mean of the skin under each dot to the middle of what the camera sees of it.
    """

    markers: tuple[str, ...]
    camera: PinholeCamera
    pose: Pose
    depths: FloatArray
    rest: FloatArray
    rest_pose: Pose
    beside: FloatArray

    @property
    def motion(self) -> Pose:
        """The motion of the head from its pose in the neutral frames, in head space."""
        turn, shift = self.rest_pose.rotations[0], self.rest_pose.translations[0]
        return Pose(turn.T @ self.pose.rotations, (self.pose.translations - shift) @ turn)

    def still(self, take: MarkerTake) -> MarkerTake:
        """Return a take as seen from far in front of a still head: (F, M, 2) [m].

        Markers that the face has not are carried along at its mean depth.
        """
        own = [take.names.index(name) for name in self.markers]
        depths = np.full((len(take.times), len(take.names)), self.rest[:, 2].mean())
        depths[:, own] = self.depths
        image = take.positions.copy()
        image[:, own] -= self.beside
        flat = self.camera.at_depths(image, self.pose, depths)[..., :2]
        metre = self.camera.focal_length / -float(np.median(self.pose.translations[:, 2]))  # px
        return replace(
            take,
            positions=flat,
            image_size=None,
            focal_length=0.0,
            diameters=None if take.diameters is None else take.diameters / metre,
            deviation=take.deviation / metre,
        )


@dataclass(frozen=True, eq=False)
class _Film:
    """A take of one camera, and the face that it is to be seen on.

    Attributes
    ----------
    take : MarkerTake
        Of M markers.
    skin : DotSkin
        Of the character under them: head space.
    neutral : (int, int)
        First and last neutral frame index, inclusive.
    """

    take: MarkerTake
    skin: DotSkin
    neutral: tuple[int, int]

    @property
    def image(self) -> FloatArray:
        return self.take.positions

    @property
    def face(self) -> FloatArray:
        """Where they rest on the character: (M, 3) [m]."""
        return self.skin.rest

    @cached_property
    def rest(self) -> FloatArray:
        """Where they rest in the image: (M, 2) [px]."""
        return neutral_markers(self.image, self.neutral)

    def without(self, beside: FloatArray) -> "_Film":
        """Return the film of the means of the skin: what lies `beside` (F, M, 2) [px] goes."""
        return replace(self, take=replace(self.take, positions=self.image - beside))

    def part(self, most: int) -> "_Film":
        """Return at most so many frames, evenly spread, and the neutral ones."""
        take, (first, last) = self.take, self.neutral
        last = min(last, first + most)
        spread = np.linspace(0, len(self.image) - 1, min(len(self.image), most)).round()
        frames = np.union1d(spread.astype(np.int64), np.arange(first, last + 1))
        start = int(np.searchsorted(frames, first))
        return replace(
            self,
            take=replace(take, times=take.times[frames], positions=self.image[frames]),
            neutral=(start, start + last - first),
        )


def film_head(
    take: MarkerTake,
    markers: tuple[str, ...],
    skin: DotSkin,
    neutral: tuple[int, int],
    solve: SolveStill,
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
    film = _Film(take.with_markers(own), skin.select(bound), neutral)
    camera, findings = _camera(film, solve)
    some = film.part(_FRAMES)
    head, weights, _ = _in_turn(some, camera, solve, _ROUNDS)
    if len(some.image) == len(film.image):
        return head, findings
    there = _at_times(weights, some.take.times, film.take.times)
    return _in_turn(film, camera, solve, _LAST_ROUNDS, head.rest[:, 2], there)[0], findings


def _camera(film: _Film, solve: SolveStill) -> tuple[PinholeCamera, list[Finding]]:
    """Return the camera, as the take gives it or as its motion shows it."""
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
    shown = bool(errors.max() > _SHOWN * errors.min())
    length = _lowest(lengths, errors) if shown else _USUAL * diagonal
    code = "FOCAL_LENGTH_FOUND" if shown else "FOCAL_LENGTH_ASSUMED"
    findings.append(finding(code, take.source, "{focal_length_px:.0f} px", length))
    return PinholeCamera(length, centre), findings


def _lowest(lengths: FloatArray, errors: FloatArray) -> float:
    """Return where a parabola through the least error and its neighbours is lowest."""
    middle = int(np.clip(errors.argmin(), 1, len(errors) - 2))
    around = slice(middle - 1, middle + 2)
    places = np.log(lengths[around])
    bend, slope, _ = np.polyfit(places, np.log(errors[around]), 2)
    if bend <= 0.0:
        return float(lengths[errors.argmin()])
    return float(np.exp(np.clip(-0.5 * slope / bend, places[0], places[-1])))


def _in_turn(
    film: _Film,
    camera: PinholeCamera,
    solve: SolveStill,
    rounds: int,
    depths: FloatArray | None = None,
    weights: FloatArray | None = None,
) -> tuple[FilmedHead, FloatArray, float]:
    """Find poses and weights in turn.

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
        RMS of what poses and weights leave of the image.
    """
    seen, take, skin, count = film, film.take, film.skin, len(film.image)
    look = start_pose(film.face, film.rest[None], camera)
    look, _ = fit_pose(film.face, film.rest[None], camera, look)
    deep = film.face[:, 2] if depths is None else depths
    if weights is None:
        weights = np.zeros((count, len(skin.evaluator.offsets)))
    pose = Pose(np.repeat(look.rotations, count, 0), np.repeat(look.translations, count, 0))
    before: FloatArray | None = None
    for done in range(rounds):
        moved = skin.mean_evaluator.displacements(weights).reshape(*film.image.shape[:2], 3)
        beside = beside_means(skin, weights, pose, camera)
        film = seen.without(beside)
        look, _ = fit_pose(film.face, film.rest[None], camera, look)
        rest = camera.at_depths(film.rest[None], look, deep)[0]
        pose, _ = fit_pose(rest + moved, film.image, camera, pose)
        if depths is None and done > 0:
            deep = _refined_depths(film, camera, look, pose, rest, moved)
            rest = camera.at_depths(film.rest[None], look, deep)[0]
            pose, _ = fit_pose(rest + moved, film.image, camera, pose)
        depth = rest[:, 2] + moved[..., 2]
        head = FilmedHead(take.names, camera, pose, depth, rest, look, beside)
        left = _rms(film.image - camera.image(pose.to_take(rest + moved)))
        still = head.still(take)
        size = left * float(np.median(-pose.translations[:, 2])) / camera.focal_length
        if before is not None and _rms(still.positions - before) < _SETTLED * size:
            break
        before = still.positions
        if done < rounds - 1:
            weights = solve(still, film.neutral)
    return head, weights, left


def _at_times(values: FloatArray, known: FloatArray, times: FloatArray) -> FloatArray:
    """Return values (K, S) at `known` times (K,) at other times (F,): (F, S)."""
    return np.stack([np.interp(times, known, column) for column in values.T], axis=1)


def _refined_depths(
    film: _Film,
    camera: PinholeCamera,
    look: Pose,
    pose: Pose,
    rest: FloatArray,
    moved: FloatArray,
) -> FloatArray:
    """Return the resting markers' depths (M,) [m] that a turning head makes more likely.

    A marker that is deeper than thought lies on the same ray in the neutral frames, and off its
    place as soon as the head turns. One step of least squares from the character's depths as a
    prior, in which all poses are free, and so are the markers' places across, as far as the neutral
    frames are noisy.
    """
    seen = visible(film.image)[..., None]
    placed = pose.to_take(rest + moved)
    left = np.where(seen, film.image - camera.image(placed), 0.0)
    poses = pose_columns(rest + moved, pose, camera) * seen[..., None]
    turns = np.linalg.qr(poses.reshape(len(left), -1, 6))[0].reshape(poses.shape)
    ways = np.tile(np.eye(3), (len(rest), 1, 1))
    ways[:, 2] = camera.rays(film.rest) @ look.rotations[0]
    ways[:, 2] /= ways[:, 2, 2:]
    moving = np.einsum("fij,mkj->fmik", pose.rotations, ways)
    columns = camera.slopes(placed) @ moving * seen[..., None]  # (F, M, 2, 3)
    shared = np.einsum("fmki,fmkj->fimj", turns, columns).reshape(len(left), 6, -1)
    normal = -np.tensordot(shared, shared, ((0, 1), (0, 1)))
    own = np.einsum("fmki,fmkj->mij", columns, columns)
    for k, block in enumerate(own):
        normal[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] += block
    posed = np.einsum("fmki,fmk->fi", turns, left)
    right = np.einsum("fmki,fmk->mi", columns, left).ravel() - np.einsum("fik,fi->k", shared, posed)
    # What poses and weights leave lasts from frame to frame: fewer frames than there are tell.
    alike = float((left[1:] * left[:-1]).sum() / max((left**2).sum(), 1e-300))
    lasting = (1.0 + alike) / (1.0 - min(alike, _MOST_ALIKE))
    scale = camera.focal_length / -float(np.median(pose.translations[:, 2]))
    least = (_MISFIT * rms_radius(film.face) * scale) ** 2
    variance = lasting * max(float((left**2).sum() / (2 * max(seen.sum(), 1))), least)
    prior = variance / (_DEPTH_SPREAD * rms_radius(film.face)) ** 2
    right[2::3] -= prior * (rest[:, 2] - film.face[:, 2])
    both = seen[1:] & seen[:-1]
    changes = np.where(both, left[1:] - left[:-1], 0.0)
    noise = float((changes**2).sum() / (4 * max(both.sum(), 1)))  # of a frame: what does not last
    first, last = film.neutral
    across = scale**2 * (last - first + 1) * variance / max(noise, 1e-12 * variance)
    normal += np.diag(np.tile([across, across, prior], len(rest)))
    step = np.linalg.solve(normal, right)
    return np.asarray(rest[:, 2] + step[2::3])


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.nanmean(values**2)))
