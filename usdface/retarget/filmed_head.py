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

from usdface.arrays import BoolArray, FloatArray
from usdface.face.dot_skin import DotSkin
from usdface.findings import Finding, finding
from usdface.geometry.marker_spread import rms_radius
from usdface.geometry.rigid_fit import Pose
from usdface.retarget.dot_centres import beside_means, facing_shares
from usdface.retarget.neutral import neutral_markers
from usdface.retarget.one_camera import PinholeCamera, fit_pose, pose_columns, start_pose
from usdface.retarget.views import Views
from usdface.takes import MarkerTake, visible

__all__ = ["FilmedHead", "SolveSeen", "film_head"]

# Poses and weights in turn, at most; and the change of markers, by their residual, at which they
# end: later rounds change weights by less than their error.
_ROUNDS = 10
_SETTLED = 0.05
# Rounds before depths are looked for: what weights that have not settled leave would be taken for
# depths, which then keep it. Of 0, 2 and 4 (four films before a phone, turning): weights are off by
# 0.072, 0.068 and 0.064, depths by 1.0, 0.2 and 0.04 mm in the end; a take that settles in three
# rounds shall still find them.
_FIRST_ROUNDS = 3
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

# A dot that is seen this obliquely (cosine) is as uncertain as any; below, circles are specks.
_LEAST_FACING = 0.1

# The weights (F, S) that are solved for a take as it is seen, given its views and neutral frames.
SolveSeen = Callable[[MarkerTake, Views, tuple[int, int]], FloatArray]


@dataclass(frozen=True, eq=False, slots=True)
class FilmedHead:
    """How a head moved before the camera.

    Attributes
    ----------
    markers : tuple of str, length M
    camera : PinholeCamera
    pose : Pose
        Of the head in camera space. Head space is that of the character at rest.
    rest : (M, 3) float64 [m]
        The resting markers, in head space.
    moved : (F, M, 3) float64 [m]
        How far the weights move them there.
    rest_pose : Pose
        Of one frame, the neutral.
    beside : (F, M, 2) float64 [px]
        From the mean of the skin under each dot to the middle of what the camera sees of it.
    facing : (F, M) float64
        Share of each dot's area that its slant leaves in the image.
    """

    markers: tuple[str, ...]
    camera: PinholeCamera
    pose: Pose
    rest: FloatArray
    moved: FloatArray
    rest_pose: Pose
    beside: FloatArray
    facing: FloatArray

    @property
    def motion(self) -> Pose:
        """The motion of the head from its pose in the neutral frames, in head space."""
        turn, shift = self.rest_pose.rotations[0], self.rest_pose.translations[0]
        return Pose(turn.T @ self.pose.rotations, (self.pose.translations - shift) @ turn)

    @property
    def metre(self) -> float:
        """Size of a metre of the head in the image [px], in the middle of the take."""
        return self.camera.focal_length / -float(np.median(self.pose.translations[:, 2]))

    def still(self, take: MarkerTake) -> MarkerTake:
        """Return a take as seen from far in front of a still head: (F, M, 2) [m].

        Markers that the face has not are carried along at its mean depth.
        """
        own = self._columns(take)
        depths = np.full((len(take.times), len(take.names)), self.rest[:, 2].mean())
        depths[:, own] = self.rest[:, 2] + self.moved[..., 2]
        image = take.positions.copy()
        image[:, own] -= self.beside
        flat = self.camera.at_depths(image, self.pose, depths)[..., :2]
        return self._in_head_space(take, flat)

    def seen(self, take: MarkerTake) -> tuple[MarkerTake, Views]:
        """Return a take as the camera sees the face move, (F, M, 2) [m], and its views.

        Its markers are at their resting places plus what the camera sees of their displacements.
        Those that the face has not are as in `still`.
        """
        own = self._columns(take)
        placed = self.pose.to_take(self.rest + self.moved)
        slopes = self.camera.slopes(placed) @ self.pose.rotations[:, None] / self.metre
        left = take.positions[:, own] - self.beside - self.camera.image(placed)
        seen = (slopes @ self.moved[..., None])[..., 0] + left / self.metre
        result = self.still(take)
        positions = result.positions.copy()
        positions[:, own] = self.rest[:, :2] + seen
        views = Views(self.markers, slopes, certainty(self.facing, visible(left)))
        return replace(result, positions=positions), views

    def _columns(self, take: MarkerTake) -> list[int]:
        return [take.names.index(name) for name in self.markers]

    def _in_head_space(self, take: MarkerTake, flat: FloatArray) -> MarkerTake:
        return replace(
            take,
            positions=flat,
            image_size=None,
            focal_length=0.0,
            diameters=None if take.diameters is None else take.diameters / self.metre,
            deviation=take.deviation / self.metre,
        )


def certainty(facing: FloatArray, seen: BoolArray) -> FloatArray:
    """Return the deviation of a take over that of its samples: (F, M).

    The deviation of a dot's place goes as one over its cosine: of six films before a phone it is
    0.12, 0.14, 0.20, 0.29 and 0.52 px at cosines of 0.95, 0.8, 0.6, 0.43 and 0.28.

    Parameters
    ----------
    facing : (F, M) float64
        As of `FilmedHead`.
    seen : (F, M) bool
    """
    cosine = facing.clip(_LEAST_FACING, 1.0)
    if not seen.any():
        return cosine
    return np.asarray(cosine * np.sqrt(np.mean(cosine[seen] ** -2.0)))


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
    solve: SolveSeen,
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


def _camera(film: _Film, solve: SolveSeen) -> tuple[PinholeCamera, list[Finding]]:
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
    solve: SolveSeen,
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
    taken, skin, count = film, film.skin, len(film.image)
    look = start_pose(film.face, film.rest[None], camera)
    look, _ = fit_pose(film.face, film.rest[None], camera, look)
    deep = film.face[:, 2] if depths is None else depths
    if weights is None:
        weights = np.zeros((count, len(skin.evaluator.offsets)))
    pose = Pose(np.repeat(look.rotations, count, 0), np.repeat(look.translations, count, 0))
    before = np.zeros(0)
    for done in range(rounds):
        moved = _moved(film, weights)
        beside = beside_means(skin, weights, pose, camera)
        facing = facing_shares(skin, weights, pose, camera)
        sure = certainty(facing, visible(film.image))
        film = taken.without(beside)
        look, _ = fit_pose(film.face, film.rest[None], camera, look)
        rest = camera.at_depths(film.rest[None], look, deep)[0]
        pose, _ = fit_pose(rest + moved, film.image, camera, pose, sure)
        if depths is None and done >= _FIRST_ROUNDS:
            deep = _refined_depths(film, camera, look, pose, rest, moved, sure)
            rest = camera.at_depths(film.rest[None], look, deep)[0]
            pose, _ = fit_pose(rest + moved, film.image, camera, pose, sure)
        head = FilmedHead(film.take.names, camera, pose, rest, moved, look, beside, facing)
        left = _rms(film.image - camera.image(pose.to_take(rest + moved)))
        still = head.still(taken.take).positions
        if done > _FIRST_ROUNDS and _rms(still - before) < _SETTLED * left / head.metre:
            break
        before = still
        if done < rounds - 1:
            weights = solve(*head.seen(taken.take), film.neutral)
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
    sure: FloatArray,
) -> FloatArray:
    """Return the resting markers' depths (M,) [m] that a turning head makes more likely.

    A marker that is deeper than thought lies on the same ray in the neutral frames, and off its
    place as soon as the head turns. One step of least squares from the character's depths as a
    prior, in which all poses are free, and so are the markers' places across, as far as the neutral
    frames are noisy.

    Parameters
    ----------
    moved : (F, M, 3) float64 [m]
        How far weights move the markers.
    sure : (F, M) float64
        As of `certainty`.
    """
    known = (visible(film.image) * sure)[..., None]
    placed = pose.to_take(rest + moved)
    left = np.where(known > 0.0, film.image - camera.image(placed), 0.0) * known
    slopes = camera.slopes(placed) * known[..., None]
    turning = slopes @ pose.rotations[:, None]
    # What poses and weights leave lasts from frame to frame: fewer frames than there are tell.
    alike = float((left[1:] * left[:-1]).sum() / max((left**2).sum(), 1e-300))
    lasting = (1.0 + alike) / (1.0 - min(alike, _MOST_ALIKE))
    scale = camera.focal_length / -float(np.median(pose.translations[:, 2]))
    least = (_MISFIT * rms_radius(film.face) * scale) ** 2
    square = float((left**2).sum() / (2 * max((known > 0.0).sum(), 1)))
    variance = lasting * max(square, least)
    poses = pose_columns(rest + moved, pose, camera) * known[..., None]
    turns = np.linalg.qr(poses.reshape(len(left), -1, 6))[0].reshape(poses.shape)
    ways = np.tile(np.eye(3), (len(rest), 1, 1))
    ways[:, 2] = camera.rays(film.rest) @ look.rotations[0]
    ways[:, 2] /= ways[:, 2, 2:]
    columns = turning @ ways.transpose(0, 2, 1)  # (F, M, 2, 3)
    shared = np.einsum("fmki,fmkj->fimj", turns, columns).reshape(len(left), 6, -1)
    normal = -np.tensordot(shared, shared, ((0, 1), (0, 1)))
    own = np.einsum("fmki,fmkj->mij", columns, columns)
    for k, block in enumerate(own):
        normal[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] += block
    posed = np.einsum("fmki,fmk->fi", turns, left)
    right = np.einsum("fmki,fmk->mi", columns, left).ravel() - np.einsum("fik,fi->k", shared, posed)
    prior = variance / (_DEPTH_SPREAD * rms_radius(film.face)) ** 2
    right[2::3] -= prior * (rest[:, 2] - film.face[:, 2])
    both = (known[1:] > 0.0) & (known[:-1] > 0.0)
    changes = np.where(both, left[1:] - left[:-1], 0.0)
    noise = float((changes**2).sum() / (4 * max(both.sum(), 1)))  # of a frame: what does not last
    first, last = film.neutral
    across = scale**2 * (last - first + 1) * variance / max(noise, 1e-12 * variance)
    normal += np.diag(np.tile([across, across, prior], len(rest)))
    step = np.linalg.solve(normal, right)
    return np.asarray(rest[:, 2] + step[2::3])


def _moved(film: _Film, weights: FloatArray) -> FloatArray:
    """Return how far weights (F, S) move the markers: (F, M, 3) [m]."""
    moved = film.skin.mean_evaluator.displacements(weights)
    return np.asarray(moved.reshape(len(weights), -1, 3))


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.nanmean(values**2)))
