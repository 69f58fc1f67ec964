"""Heads that turn before a camera whose poses, depths and focal length are known."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation
from worlds import World, make_world

from usdface.arrays import FloatArray
from usdface.face.dot_skin import DotSkin
from usdface.face.marker_surface import MarkerSurface
from usdface.geometry.rigid_fit import Pose
from usdface.retarget.film.film_head import SolveOnSkin, film_head
from usdface.retarget.film.filmed_head import FilmedHead
from usdface.retarget.film.one_camera import PinholeCamera
from usdface.retarget.film.views import Views
from usdface.takes import MarkerTake

__all__ = [
    "CAMERA",
    "COUNT",
    "FACE",
    "FOCAL",
    "MESH",
    "NEUTRAL",
    "PLACES",
    "SIZE",
    "SURFACE",
    "VERTICES",
    "WORLD",
    "filmed",
    "filmed_markers",
    "found",
    "placed",
    "true_weights",
    "turning",
]

WORLD = make_world(head_moves=False)
MESH = WORLD.rig.meshes[0]
PLACES = np.array(list(WORLD.points.values()))
FACE = MESH.points[PLACES]
SURFACE = MarkerSurface(MESH, PLACES)
VERTICES = SURFACE.skin
NEUTRAL = (0, 0)
FOCAL, SIZE = 1300.0, (1280, 960)
CAMERA = PinholeCamera(FOCAL, 0.5 * np.array(SIZE) * [1, -1])
COUNT = len(WORLD.weights)


def turning(degrees: float) -> Pose:
    """The motion of a head that turns by so much to either side."""
    swing = degrees * np.sin(np.linspace(0, 5, COUNT))
    angles = np.stack([0.4 * swing, swing, -0.2 * swing], axis=1)
    turn = Rotation.from_euler("xyz", angles, degrees=True).as_matrix()
    shift = 0.03 * np.sin(np.linspace(0, 3, COUNT))[:, None] * [1.0, 0.5, -1.0]
    return Pose(turn, shift)


def placed(motion: Pose) -> Pose:
    """Its pose in camera space, half a metre away."""
    return Pose(motion.rotations, motion.translations + np.array([0.02, 0.01, -0.5]))


def filmed(world: World, degrees: float, focal: float = FOCAL) -> tuple[MarkerTake, Pose]:
    """A take of the world's face by the camera, and the head's motion."""
    motion = turning(degrees)
    camera = PinholeCamera(focal, CAMERA.centre)
    image = camera.image(placed(motion).to_take(world.take.positions))
    return replace(world.take, positions=image, image_size=SIZE), motion


def filmed_markers(placed: FloatArray, degrees: float, noise: float = 0.0) -> MarkerTake:
    """Film markers (F, M, 3), 30 a second, on a head that turns after ten neutral frames.

    `noise` is in pixels.
    """
    count = len(placed)
    swing = np.sin(np.linspace(0, 6, count)) * np.clip((np.arange(count) - 10) / 10, 0, 1)
    turn = Rotation.from_rotvec(np.radians(degrees) * swing[:, None] * [0.3, 1.0, 0.1])
    pose = Pose(turn.as_matrix(), np.tile([0.01, 0.0, -0.6], (count, 1)))
    image = CAMERA.image(pose.to_take(placed))
    image += noise * np.random.default_rng(3).normal(size=image.shape)
    names, times = tuple(f"m{k}" for k in range(placed.shape[1])), np.arange(count) / 30.0
    return MarkerTake(names, times, image, 30.0, image_size=SIZE, focal_length=FOCAL)


def true_weights(
    skin: DotSkin, take: MarkerTake, views: Views, neutral: tuple[int, int]
) -> FloatArray:
    """The weights of the world, as a perfect solve finds them."""
    return np.array(WORLD.weights[np.searchsorted(WORLD.take.times, take.times)])


def found(
    take: MarkerTake,
    surface: MarkerSurface = SURFACE,
    solve: SolveOnSkin = true_weights,
    refined: bool = False,
    weighted: bool = True,
) -> tuple[FilmedHead, list[str]]:
    """The head of a take, and the codes of the findings."""
    face, findings = film_head(
        take, WORLD.take.names, surface, NEUTRAL, solve, refined=refined, weighted=weighted
    )
    assert face is not None
    return face.head, [f.code for f in findings]
