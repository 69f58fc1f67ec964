"""Places and neutral frames of a film of named landmarks that does not begin at rest."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from usdface.binding.face_surface import face_surface
from usdface.binding.landmarks import find_landmarks
from usdface.binding.propose import propose
from usdface.binding.propose_film import propose_film
from usdface.face.marker_name_places import named_places
from usdface.io.usd.rig import read_rig
from usdface.retarget.film.one_camera import PinholeCamera
from usdface.rigs import Mesh
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake

ROOT = Path(__file__).resolve().parents[2]
NAMES = tuple(f"landmark_{number}" for number in range(68))
PLACED = tuple(name for name, place in zip(NAMES, named_places(NAMES), strict=True) if place)
NOTHING = RetargetSetup(Binding((), np.zeros(0, dtype=np.int64)))
FRAMES, HELD, REST, RATE = 240, 45, slice(150, 170), 30.0


@pytest.fixture(scope="module")
def mesh() -> Mesh:
    return read_rig(ROOT / "examples" / "head.usdc")[0].face()


@pytest.fixture(scope="module")
def take(mesh: Mesh) -> MarkerTake:
    """Eight seconds of a head that turns by 20 degrees 0.6 m away, at rest for two thirds of one.

    It begins with an expression that is held; then shapes come and go between 0.1 and 0.8.
    """
    landmarks = find_landmarks(face_surface(mesh))
    assert landmarks is not None
    places = [place.places[0] for place in named_places(PLACED) if place]
    vertices = landmarks.surface.vertices[landmarks.vertices_at(np.array(places, dtype=float))]
    rng, times = np.random.default_rng(1), np.arange(FRAMES) / RATE
    weights = np.zeros((FRAMES, len(mesh.shapes)))
    for shape in rng.choice(len(mesh.shapes), 8, replace=False):
        weights[:, shape] = 0.45 - 0.35 * np.cos(times * rng.uniform(2.0, 5.0) + 6.0 * rng.random())
    weights[:HELD] = weights[HELD]
    away = np.minimum(abs(np.arange(FRAMES) - REST.start), abs(np.arange(FRAMES) - REST.stop + 1))
    away[REST] = 0
    weights *= np.clip(away / 10.0, 0.0, 1.0)[:, None]
    points = mesh.points[vertices]
    swing = 20.0 * np.sin(np.outer(times, [1.1, 0.7, 0.9]))
    turns = Rotation.from_euler("xyz", swing, degrees=True).as_matrix()
    moved = points + np.tensordot(weights, mesh.offsets_at(vertices), 1) - points.mean(axis=0)
    placed = np.einsum("fij,fmj->fmi", turns, moved) - [0.0, 0.0, 0.6]
    image = PinholeCamera(1100.0, np.array([640.0, -480.0])).image(placed)
    image += 0.2 * rng.standard_normal(image.shape)
    return MarkerTake(PLACED, times, image, RATE, image_size=(1280, 960), source="face.csv")


def test_the_rest_of_a_film_is_found_and_places_are_proposed_from_it(
    mesh: Mesh, take: MarkerTake
) -> None:
    found = propose_film(take, mesh, NOTHING).setup
    assert found.neutral is not None
    assert REST.start - 3 <= found.neutral[0] <= found.neutral[1] < REST.stop + 3
    named = propose(take, mesh, replace(NOTHING, neutral=found.neutral)).setup
    np.testing.assert_array_equal(found.binding.points, named.binding.points)
    assert found.binding.markers == named.binding.markers
