"""Places of filmed markers by their motion, on a smooth head before a camera."""

from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest
from filmed import CAMERA, FOCAL, SIZE, filmed_markers
from skins import LIP, RATE, joined_lips, make_head

from usdface.arrays import FloatArray
from usdface.face.dot_skin import DotSkin
from usdface.face.marker_surface import MarkerSurface
from usdface.retarget.film.film_head import FilmedFace, film_head
from usdface.retarget.film.views import Views
from usdface.takes import MarkerTake

HEAD = make_head()
NAMES = tuple(f"m{k}" for k in range(len(HEAD.vertices)))
SHIFTS = HEAD.beside(0.003, seed=5)
NONE = np.zeros_like(SHIFTS)
NEUTRAL = (0, 9)


def film(shifts: FloatArray, degrees: float, noise: float = 0.0) -> MarkerTake:
    """Film the head with markers beside their vertices."""
    return filmed_markers(HEAD.performed(shifts), degrees, noise)


def known(skin: DotSkin, take: MarkerTake, views: Views, neutral: tuple[int, int]) -> FloatArray:
    return HEAD.weights


def solved(
    take: MarkerTake, surface: MarkerSurface = HEAD.surface, *, refined: bool = True
) -> FilmedFace:
    head, _ = film_head(take, NAMES, surface, NEUTRAL, known, refined=refined)
    assert head is not None
    return head


def rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


@pytest.mark.slow
@pytest.mark.parametrize("degrees", [0.0, 20.0])
def test_markers_beside_their_vertices_are_found(degrees: float) -> None:
    head = solved(film(SHIFTS, degrees, noise=0.2))
    assert rms(head.shifts - SHIFTS) < 0.3 * rms(SHIFTS)


@pytest.mark.slow
def test_markers_on_their_vertices_stay_there() -> None:
    """Noise of the neutral looks like places that are beside."""
    head = solved(film(NONE, 20.0, noise=0.2))
    assert np.linalg.norm(head.shifts, axis=1).max() < 0.0003
    exact = solved(film(NONE, 20.0))
    assert np.linalg.norm(exact.shifts, axis=1).max() < 1e-6


def test_places_that_are_bound_stay() -> None:
    assert not solved(film(SHIFTS, 20.0), refined=False).shifts.any()


def test_a_mesh_of_points_stays_on_its_vertices(monkeypatch: pytest.MonkeyPatch) -> None:
    module = import_module("usdface.retarget.film.film_head")
    monkeypatch.setattr(module, "MOST_MARKERS", len(NAMES) - 1)
    assert not solved(film(SHIFTS, 20.0)).shifts.any()


@pytest.mark.slow
def test_hidden_markers_are_found_where_they_show() -> None:
    take = film(SHIFTS, 20.0, noise=0.2)
    positions = take.positions.copy()
    positions[30:90, :9] = positions[100] = np.nan
    head = solved(replace(take, positions=positions))
    assert np.isfinite(head.shifts).all()
    assert rms(head.shifts - SHIFTS) < 0.4 * rms(SHIFTS)


@pytest.mark.slow
def test_markers_that_are_not_filmed_stay_on_their_vertices() -> None:
    take = film(SHIFTS, 20.0, noise=0.2)
    kept = np.delete(np.arange(len(NAMES)), [4, 11])
    head = solved(take.with_markers(kept))
    assert not head.shifts[[4, 11]].any()
    assert rms(head.shifts[kept] - SHIFTS[kept]) < 0.3 * rms(SHIFTS)


@pytest.mark.parametrize("moves_with", [2, 3])
def test_a_marker_on_the_wrong_lip_is_put_on_the_other_and_no_other(moves_with: int) -> None:
    """Bound to the upper lip beside the corner, it moves with the lower one, or where it is."""
    mesh, corner = joined_lips(), 3 * LIP + 1
    mesh = replace(mesh, points=mesh.points - 10.0 * mesh.points[:, :1] ** 2 * [0.0, 0.0, 1.0])
    others = [row * LIP + column for row in (0, 2, 3, 5) for column in (6, 12, 18, 24, 30)]
    names = tuple(f"m{k}" for k in range(1 + len(others)))
    truth = np.array([moves_with * LIP + 1, *others])
    weights = np.clip(np.sin(np.arange(90) / 9.0 - 1.0), 0.0, 1.0)[:, None]
    rest = mesh.points[truth] + 0.001 * np.random.default_rng(4).normal(size=(len(truth), 3))
    placed = rest + np.einsum("fs,smd->fmd", weights, mesh.offsets_at(truth))
    image = CAMERA.image(placed - np.array([0.0, 0.0, 0.5]))
    image += 0.1 * np.random.default_rng(1).normal(size=image.shape)
    times = np.arange(90) / RATE
    take = MarkerTake(names, times, image, RATE, image_size=SIZE, focal_length=FOCAL)
    surface = MarkerSurface(mesh, np.array([corner, *others]))
    head, _ = film_head(take, names, surface, NEUTRAL, lambda *_: weights)
    assert head is not None
    away = np.linalg.norm(mesh.points - (mesh.points[corner] + head.shifts[0]), axis=1)
    assert (away.argmin() < 3 * LIP) == (moves_with == 2)
