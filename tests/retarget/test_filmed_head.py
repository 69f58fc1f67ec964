"""Heads that turn before a camera whose poses, depths and focal length are known."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from worlds import World, make_world

from usdface.face.dot_skin import DotSkin, dot_skin
from usdface.geometry.rigid_fit import Pose
from usdface.retarget.dot_centres import beside_means
from usdface.retarget.film_head import film_head
from usdface.retarget.filmed_head import FilmedHead
from usdface.retarget.one_camera import PinholeCamera
from usdface.retarget.views import Views
from usdface.takes import MarkerTake

WORLD = make_world(head_moves=False)
MESH = WORLD.rig.meshes[0]
PLACES = np.array(list(WORLD.points.values()))
FACE = MESH.points[PLACES]
VERTICES = dot_skin(MESH, PLACES, np.full(len(PLACES), np.nan))
NEUTRAL = (0, 0)
FOCAL, SIZE = 1300.0, (1280, 960)
COUNT = len(WORLD.weights)


def filmed(world: World, degrees: float, focal: float = FOCAL) -> tuple[MarkerTake, Pose]:
    """A take of the world's face by a camera half a metre away, and the head's motion."""
    swing = degrees * np.sin(np.linspace(0, 5, COUNT))
    angles = np.stack([0.4 * swing, swing, -0.2 * swing], axis=1)
    turn = Rotation.from_euler("xyz", angles, degrees=True).as_matrix()
    shift = 0.03 * np.sin(np.linspace(0, 3, COUNT))[:, None] * [1.0, 0.5, -1.0]
    motion = Pose(turn, shift)
    placed = motion.to_take(world.take.positions) + np.array([0.02, 0.01, -0.5])
    camera = PinholeCamera(focal, 0.5 * np.array(SIZE) * [1, -1])
    take = replace(world.take, positions=camera.image(placed), image_size=SIZE)
    return take, motion


def true_weights(take: MarkerTake, views: Views, neutral: tuple[int, int]) -> np.ndarray:
    """The weights of the world, as a perfect solve finds them."""
    return np.array(WORLD.weights[np.searchsorted(WORLD.take.times, take.times)])


def found(take: MarkerTake, skin: DotSkin = VERTICES) -> tuple[FilmedHead, list[str]]:
    head, findings = film_head(take, WORLD.take.names, skin, NEUTRAL, true_weights)
    assert head is not None
    return head, [f.code for f in findings]


def test_the_head_moves_as_it_did_and_its_markers_stand_still() -> None:
    take, motion = filmed(WORLD, 20.0)
    head, codes = found(replace(take, focal_length=FOCAL))
    assert codes == []
    np.testing.assert_allclose(head.motion.rotations, motion.rotations, atol=1e-6)
    np.testing.assert_allclose(head.motion.translations, motion.translations, atol=1e-6)
    still = head.still(take).positions
    np.testing.assert_allclose(still, WORLD.take.positions[..., :2], atol=1e-6)


def test_a_turning_head_shows_the_focal_length() -> None:
    take, _ = filmed(WORLD, 20.0)
    head, codes = found(take)
    assert codes == ["FOCAL_LENGTH_FOUND"]
    assert head.camera.focal_length == pytest.approx(FOCAL, rel=0.15)


def test_without_its_size_an_image_is_taken_to_be_centred_on_the_face() -> None:
    take, _ = filmed(WORLD, 20.0)
    head, codes = found(replace(take, image_size=None, focal_length=FOCAL))
    assert codes == ["IMAGE_SIZE_ASSUMED"]
    np.testing.assert_allclose(head.camera.centre, np.mean(take.positions[0], axis=0))


def test_a_turning_head_shows_how_deep_the_face_is() -> None:
    deeper = np.random.default_rng(5).normal(scale=0.003, size=len(FACE))
    own = FACE + deeper[:, None] * [0.0, 0.0, 1.0]
    take, _ = filmed(
        replace(WORLD, take=replace(WORLD.take, positions=WORLD.take.positions + own - FACE)), 25.0
    )
    head, _ = found(replace(take, focal_length=FOCAL))
    off = head.rest[:, 2] - own[:, 2]
    # Shifts, turns and scale along the view are those of the pose.
    columns = np.column_stack([np.ones(len(FACE)), FACE])
    off = off - columns @ np.linalg.lstsq(columns, off, rcond=None)[0]
    before = deeper - columns @ np.linalg.lstsq(columns, deeper, rcond=None)[0]
    assert np.sqrt(np.mean(off**2)) < 0.3 * np.sqrt(np.mean(before**2))


def test_a_face_that_does_not_turn_keeps_the_depths_of_the_character() -> None:
    take, _ = filmed(WORLD, 0.0)
    noise = np.random.default_rng(6).normal(scale=0.3, size=take.positions.shape)
    head, _ = found(replace(take, positions=take.positions + noise, focal_length=FOCAL))
    assert np.sqrt(np.mean((head.rest[:, 2] - FACE[:, 2]) ** 2)) < 0.002


@pytest.mark.parametrize("hidden", [0, 4])
def test_expressions_that_the_solve_leaves_make_no_depth(hidden: int) -> None:
    """A still face that hardly turns by its pose: a tenth of each movement is taken for turns."""

    def most_of_the_weights(take: MarkerTake, views: Views, neutral: tuple[int, int]) -> np.ndarray:
        return 0.9 * true_weights(take, views, neutral)

    take, _ = filmed(WORLD, 0.0)
    positions = take.positions.copy()
    positions[20 : 20 + hidden, 3] = np.nan
    film = replace(take, positions=positions, focal_length=FOCAL)
    head, _ = film_head(film, WORLD.take.names, VERTICES, NEUTRAL, most_of_the_weights)
    assert head is not None
    assert np.sqrt(np.mean((head.rest[:, 2] - FACE[:, 2]) ** 2)) < 0.001


def test_hidden_markers_stay_hidden_and_cost_nothing() -> None:
    take, motion = filmed(WORLD, 15.0)
    positions = take.positions.copy()
    positions[5:20, 3] = np.nan
    head, _ = found(replace(take, positions=positions, focal_length=FOCAL))
    assert np.isnan(head.still(replace(take, positions=positions)).positions[5:20, 3]).all()
    np.testing.assert_allclose(head.motion.rotations, motion.rotations, atol=1e-6)


def test_five_markers_are_too_few() -> None:
    take, _ = filmed(WORLD, 15.0)
    names = take.names[:5]
    few = replace(take, names=names, positions=take.positions[:, :5])
    skin = VERTICES.select(np.arange(5))
    assert film_head(few, names, skin, NEUTRAL, true_weights) == (None, [])


def test_of_a_dot_the_middle_is_filmed_and_the_mean_of_its_skin_is_solved() -> None:
    take, motion = filmed(WORLD, 20.0)
    camera = PinholeCamera(FOCAL, 0.5 * np.array(SIZE) * [1, -1])
    dots = dot_skin(MESH, PLACES, np.full(len(PLACES), 0.006))
    pose = Pose(motion.rotations, motion.translations + np.array([0.02, 0.01, -0.5]))
    weights = np.array(WORLD.weights)
    moved = dots.mean_evaluator.displacements(weights).reshape(COUNT, -1, 3)
    means = dots.rest + moved
    middles = camera.image(pose.to_take(means)) + beside_means(dots, weights, pose, camera)
    film = replace(take, positions=middles, focal_length=FOCAL)
    off = [
        np.abs(found(film, skin)[0].motion.rotations - motion.rotations).max()
        for skin in (VERTICES, dots)
    ]
    assert off[1] < 1e-5 < 1e-3 < off[0]
    np.testing.assert_allclose(
        found(film, dots)[0].still(film).positions, means[..., :2], atol=1e-5
    )
