"""Places of filmed markers by their motion, on a smooth head before a camera."""

from dataclasses import replace

import numpy as np
import pytest
from filmed import CAMERA, FOCAL, SIZE
from scipy.spatial.transform import Rotation
from skins import FRAMES, RATE, make_head

from usdface.arrays import FloatArray
from usdface.face.dot_skin import DotSkin
from usdface.face.marker_surface import MarkerSurface
from usdface.geometry.rigid_fit import Pose
from usdface.retarget.film.film_head import film_head
from usdface.retarget.film.filmed_head import FilmedHead
from usdface.retarget.film.views import Views
from usdface.takes import MarkerTake

HEAD = make_head()
NAMES = tuple(f"m{k}" for k in range(len(HEAD.vertices)))
SHIFTS = HEAD.beside(0.003, seed=5)
NONE = np.zeros_like(SHIFTS)
NEUTRAL = (0, 9)


def film(shifts: FloatArray, degrees: float, noise: float = 0.0) -> MarkerTake:
    """Film the head with markers beside their vertices, turning once the neutral frames are over.

    `noise` is in pixels.
    """
    swing = np.sin(np.linspace(0, 6, FRAMES)) * np.clip((np.arange(FRAMES) - 10) / 10, 0, 1)
    turn = Rotation.from_rotvec(np.radians(degrees) * swing[:, None] * [0.3, 1.0, 0.1])
    pose = Pose(turn.as_matrix(), np.tile([0.01, 0.0, -0.6], (FRAMES, 1)))
    image = CAMERA.image(pose.to_take(HEAD.performed(shifts)))
    image += noise * np.random.default_rng(3).normal(size=image.shape)
    return MarkerTake(NAMES, HEAD.times, image, RATE, image_size=SIZE, focal_length=FOCAL)


def known(skin: DotSkin, take: MarkerTake, views: Views, neutral: tuple[int, int]) -> FloatArray:
    return HEAD.weights


def solved(
    take: MarkerTake, surface: MarkerSurface = HEAD.surface, *, refined: bool = True
) -> FilmedHead:
    head, _ = film_head(take, NAMES, surface, NEUTRAL, known, refined=refined)
    assert head is not None
    return head


def rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


@pytest.mark.parametrize("degrees", [0.0, 20.0])
def test_markers_beside_their_vertices_are_found(degrees: float) -> None:
    head = solved(film(SHIFTS, degrees, noise=0.2))
    assert rms(head.shifts - SHIFTS) < 0.3 * rms(SHIFTS)


def test_markers_on_their_vertices_stay_there() -> None:
    """Noise of the neutral looks like places that are beside."""
    head = solved(film(NONE, 20.0, noise=0.2))
    assert np.linalg.norm(head.shifts, axis=1).max() < 0.0003
    exact = solved(film(NONE, 20.0))
    assert np.linalg.norm(exact.shifts, axis=1).max() < 1e-6


def test_places_that_are_bound_stay() -> None:
    assert not solved(film(SHIFTS, 20.0), refined=False).shifts.any()


def test_hidden_markers_are_found_where_they_show() -> None:
    take = film(SHIFTS, 20.0, noise=0.2)
    positions = take.positions.copy()
    positions[30:90, :9] = positions[100] = np.nan
    head = solved(replace(take, positions=positions))
    assert np.isfinite(head.shifts).all()
    assert rms(head.shifts - SHIFTS) < 0.4 * rms(SHIFTS)


def test_markers_that_are_not_filmed_stay_on_their_vertices() -> None:
    take = film(SHIFTS, 20.0, noise=0.2)
    kept = np.delete(np.arange(len(NAMES)), [4, 11])
    head = solved(take.with_markers(kept))
    assert not head.shifts[[4, 11]].any()
    assert rms(head.shifts[kept] - SHIFTS[kept]) < 0.3 * rms(SHIFTS)


def test_a_marker_that_is_far_away_is_searched() -> None:
    """Bound 9 mm from its place: a step by slopes would end elsewhere."""
    vertices = HEAD.vertices.copy()
    near = HEAD.surface.vertices_near(14)
    away = np.linalg.norm(HEAD.mesh.points[near] - HEAD.points[14], axis=1)
    vertices[14] = near[away.argmax()]
    surface = replace(HEAD.surface, vertices=vertices)
    head = solved(film(HEAD.beside(0.001, seed=5), 20.0, noise=0.2), surface)
    place = HEAD.mesh.points[vertices[14]] + head.shifts[14]
    assert np.linalg.norm(place - HEAD.points[14]) < 0.4 * away.max()
