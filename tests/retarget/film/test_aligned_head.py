from dataclasses import replace

import numpy as np
from filmed import CAMERA, FACE, FOCAL, WORLD, filmed, found, placed, turning
from scipy.spatial.transform import Rotation

from usdface.arrays import FloatArray
from usdface.face.dot_skin import DotSkin
from usdface.geometry.rigid_fit import Pose, similarity_fit
from usdface.retarget.film.aligned_head import aligned_head
from usdface.retarget.film.one_camera import fit_pose, start_pose
from usdface.retarget.film.views import Views
from usdface.takes import MarkerTake

TILTED = Rotation.from_euler("x", 20.0, degrees=True).as_matrix()

REPEATED = 12


def test_the_markers_lie_on_the_character_and_the_camera_sees_the_same() -> None:
    pose = placed(turning(10.0))
    rest = 1.1 * FACE @ TILTED.T + [0.01, 0.02, -0.005]
    first = Pose(pose.rotations[:1], pose.translations[:1])
    rest_pose, moved, there = aligned_head(first, pose, rest, FACE, 0.0)
    np.testing.assert_allclose(there, FACE, atol=1e-12)
    for before, after in ((pose, moved), (first, rest_pose)):
        points = [np.broadcast_to(p, (len(before.rotations), *p.shape)) for p in (rest, there)]
        seen = CAMERA.image(after.to_take(points[1]))
        np.testing.assert_allclose(seen, CAMERA.image(before.to_take(points[0])), atol=1e-9)


def test_other_proportions_do_not_tilt_a_head_that_turns() -> None:
    """A performer whose cheeks and contour are lower than the character's."""
    own = FACE.copy()
    own[:, 1] += 0.3 * (FACE[:, 2] - FACE[:, 2].max())
    moved = WORLD.take.positions - FACE + own
    take, _ = filmed(replace(WORLD, take=replace(WORLD.take, positions=moved)), 25.0)
    positions = np.tile(take.positions, (REPEATED, 1, 1))
    times = np.arange(len(positions)) / take.rate
    long = replace(take, times=times, positions=positions, focal_length=FOCAL)
    head, _ = found(long, solve=true_weights_again)
    neutral = take.positions[:1]
    by_image = fit_pose(FACE, neutral, CAMERA, start_pose(FACE, neutral, CAMERA))
    linear, _ = similarity_fit(FACE, own)
    expected = linear.T / np.cbrt(np.linalg.det(linear))

    def tilt(pose: Pose) -> float:
        return float(Rotation.from_matrix(pose.rotations[0] @ expected.T).magnitude())

    assert tilt(head.rest_pose) < 0.3 * tilt(by_image)


def true_weights_again(
    skin: DotSkin, take: MarkerTake, views: Views, neutral: tuple[int, int]
) -> FloatArray:
    return np.tile(WORLD.weights, (REPEATED, 1))


def test_depths_that_are_not_known_do_not_turn_the_head() -> None:
    pose = placed(turning(10.0))
    first = Pose(pose.rotations[:1], pose.translations[:1])
    noisy = FACE + 0.01 * np.random.default_rng(1).normal(size=len(FACE))[:, None] * [0, 0, 1]
    turns = [
        Rotation.from_matrix(
            aligned_head(first, pose, noisy, FACE, deviation)[0].rotations[0] @ first.rotations[0].T
        ).magnitude()
        for deviation in (0.0, 0.01)
    ]
    assert turns[1] < 0.3 * turns[0]
