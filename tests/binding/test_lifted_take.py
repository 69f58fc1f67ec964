from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from usdface.binding.face_surface import FaceSurface, face_surface
from usdface.binding.landmarks import FaceLandmarks, find_landmarks
from usdface.binding.lifted_take import lifted_take
from usdface.binding.propose import propose
from usdface.errors import InputError
from usdface.face.marker_name_places import named_places
from usdface.io.usd.rig import read_rig
from usdface.retarget.film.one_camera import PinholeCamera
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake

ROOT = Path(__file__).resolve().parents[2]
NAMES = tuple(f"landmark_{number}" for number in range(68))
PLACED = tuple(name for name, place in zip(NAMES, named_places(NAMES), strict=True) if place)
FRAMES, REST = 60, 10
NOTHING = RetargetSetup(Binding((), np.zeros(0, dtype=np.int64)))


@pytest.fixture(scope="module")
def surface() -> FaceSurface:
    return face_surface(read_rig(ROOT / "examples" / "head.usdc")[0].face())


@pytest.fixture(scope="module")
def landmarks(surface: FaceSurface) -> FaceLandmarks:
    found = find_landmarks(surface)
    assert found is not None
    return found


def vertices_of(landmarks: FaceLandmarks, names: tuple[str, ...]) -> np.ndarray:
    places = [place.places[0] for place in named_places(names) if place]
    return landmarks.surface.vertices[landmarks.vertices_at(np.array(places, dtype=float))]


def turns(degrees: float) -> np.ndarray:
    swing = degrees * np.sin(np.outer(np.linspace(0, 6, FRAMES), [1.1, 0.7, 0.9]))
    return np.asarray(Rotation.from_euler("xyz", swing, degrees=True).as_matrix())


def far_away(points: np.ndarray, rotations: np.ndarray, scale: float = 900.0) -> np.ndarray:
    """Markers as a camera far away shows them: (F, M, 2) [px]."""
    turned = np.einsum("fij,mj->fmi", rotations, points)
    return np.asarray(scale * turned[..., :2] + [640.0, -480.0])


def image(names: tuple[str, ...], positions: np.ndarray) -> MarkerTake:
    return MarkerTake(names, np.arange(len(positions)) / 30, positions, 30.0, source="face.csv")


def test_a_rigid_face_is_lifted_to_its_own_places(
    surface: FaceSurface, landmarks: FaceLandmarks
) -> None:
    points = surface.mesh.points[vertices_of(landmarks, PLACED)]
    rotations = turns(15.0)
    lifted = lifted_take(image(PLACED, far_away(points, rotations)), surface).positions
    expected = np.einsum("fij,mj->fmi", rotations, points)
    np.testing.assert_allclose(lifted, expected, rtol=0, atol=1e-9)


def test_another_size_distance_and_place_in_the_image_change_nothing(
    surface: FaceSurface, landmarks: FaceLandmarks
) -> None:
    points = surface.mesh.points[vertices_of(landmarks, PLACED)]
    rng = np.random.default_rng(0)
    points = points + 0.002 * rng.standard_normal(points.shape)
    filmed = far_away(points, turns(10.0))
    near = 1.7 * filmed + 100.0 * rng.standard_normal((FRAMES, 1, 2))
    one, other = (lifted_take(image(PLACED, each), surface).positions for each in (filmed, near))
    np.testing.assert_allclose(one, other, rtol=0, atol=1e-9)


@pytest.mark.slow
def test_a_mirrored_image_is_no_face_seen_from_behind(
    surface: FaceSurface, landmarks: FaceLandmarks
) -> None:
    points = surface.mesh.points[vertices_of(landmarks, PLACED)]
    filmed = far_away(points, turns(10.0)) * [-1.0, 1.0]
    lifted = lifted_take(image(PLACED, filmed), surface).positions
    nose, eye = PLACED.index("landmark_30"), PLACED.index("landmark_36")
    assert (lifted[:, nose, 2] > lifted[:, eye, 2]).all()
    exchanged = propose(image(PLACED, filmed), surface.mesh, NOTHING).exchanged
    assert len(exchanged) > 0.8 * len(PLACED)


def test_frames_that_show_too_few_markers_are_occluded(
    surface: FaceSurface, landmarks: FaceLandmarks
) -> None:
    filmed = far_away(surface.mesh.points[vertices_of(landmarks, PLACED)], turns(5.0))
    filmed[3, 4:] = np.nan
    filmed[7, 0] = np.nan
    filmed[20, : len(PLACED) // 2 + 2] = np.nan
    lifted = lifted_take(image(PLACED, filmed), surface).positions
    hidden = np.zeros(lifted.shape[:2], dtype=bool)
    hidden[[3, 20]], hidden[7, 0] = True, True
    np.testing.assert_array_equal(np.isnan(lifted).all(axis=2), hidden)


def test_markers_whose_names_tell_no_place_need_a_vertex(
    surface: FaceSurface, landmarks: FaceLandmarks
) -> None:
    vertices = vertices_of(landmarks, PLACED)
    filmed = far_away(surface.mesh.points[vertices], turns(5.0))
    words = ("left_eye_outer", "right_eye_outer", "chin", "nose_tip", "left_mouth_corner", "a", "b")
    order = [PLACED.index(f"landmark_{number}") for number in (45, 36, 8, 30, 54, 48, 22)]
    take = image(words, filmed[:, order])
    assert lifted_take(take, surface).names == words[:5]
    given = np.full((7, 3), np.nan)
    given[5] = surface.mesh.points[vertices[order[5]]]
    assert lifted_take(take, surface, given).names == words[:6]
    with pytest.raises(InputError, match=r"is of an image; .* on the page of `usdface bind`"):
        lifted_take(replace(take, names=tuple("abcdefg")), surface)


@pytest.mark.slow
def test_filmed_landmarks_are_placed_by_their_names(
    surface: FaceSurface, landmarks: FaceLandmarks
) -> None:
    """A head that turns by 20 degrees 0.6 m away, opens its mouth and raises its brows."""
    mesh, vertices = surface.mesh, vertices_of(landmarks, PLACED)
    rng = np.random.default_rng(1)
    weights = np.zeros((FRAMES, len(mesh.shapes)))
    phase = np.linspace(0.0, 4 * np.pi, FRAMES - REST)
    for shape in rng.choice(len(mesh.shapes), 8, replace=False):
        weights[REST:, shape] = 0.4 * (1.0 - np.cos(phase * rng.uniform(0.7, 1.3)))
    moved = np.tensordot(weights, mesh.offsets_at(vertices), 1)
    centre = mesh.points[vertices].mean(axis=0)
    placed = mesh.points[vertices] + moved - centre
    turned = np.einsum("fij,fmj->fmi", turns(20.0), placed) - [0.0, 0.0, 0.6]
    filmed = PinholeCamera(1100.0, np.array([640.0, -480.0])).image(turned)
    filmed += 0.35 * rng.standard_normal(filmed.shape)
    setup = replace(NOTHING, neutral=(0, REST - 1))
    proposal = propose(image(PLACED, filmed), mesh, setup)
    binding, unsure = proposal.setup.binding, proposal.setup.unsure
    found = dict(zip(binding.markers, binding.points.tolist(), strict=True))
    assert not proposal.contradicted and len(unsure.markers) < 0.1 * len(PLACED)
    bound = [PLACED.index(name) for name in binding.markers]
    own = mesh.points[[found[PLACED[i]] for i in bound]]
    apart = np.linalg.norm(own[:, None] - mesh.points[vertices[bound]], axis=2)
    outer = [mesh.points[vertices[PLACED.index(f"landmark_{n}")]] for n in (36, 45)]
    share = np.diagonal(apart) / np.linalg.norm(outer[0] - outer[1])
    assert np.median(share) < 0.04 and np.mean(share < 0.1) > 0.9
