"""A film solved with markers beside their vertices, on a smooth head before a camera."""

from importlib import import_module

import numpy as np
import pytest
from filmed import CAMERA, filmed_markers
from skins import make_head

from usdface.arrays import FloatArray
from usdface.retarget.film.filmed_take import FilmedTake
from usdface.retarget.film.placed_film import PlacedFilm, solved_again, with_places
from usdface.retarget.film.solve_film import solve_film
from usdface.retarget.places import guess_in_image

HEAD = make_head()
NONE = np.zeros((len(HEAD.vertices), 3))
BESIDE = HEAD.beside(0.003, seed=5)


def known(*_: object) -> FloatArray:
    return HEAD.weights


def on_vertices(shifts: FloatArray, markers: slice = slice(None)) -> PlacedFilm:
    """A film of markers at these places, solved with the `markers` on their vertices."""
    bound = np.arange(len(NONE))[markers]
    take = filmed_markers(HEAD.performed(shifts), 20.0, noise=0.2).with_markers(bound)
    film = FilmedTake(take, HEAD.surface.skin.select(bound), (0, 9))
    return PlacedFilm(solve_film(film, CAMERA, known, 10), HEAD.surface, bound, NONE)


def test_the_skin_is_that_at_the_places() -> None:
    before = on_vertices(NONE)
    there = solved_again(before, HEAD.surface, BESIDE, known)
    np.testing.assert_array_equal(there.skin.rest, HEAD.surface.at(BESIDE).skin.rest)
    np.testing.assert_array_equal(there.solved.film.face, there.skin.rest)
    assert np.abs(there.skin.rest - before.skin.rest).max() > 0.002


def test_at_their_true_places_markers_leave_less_and_elsewhere_more() -> None:
    before = on_vertices(BESIDE)
    there = solved_again(before, HEAD.surface, BESIDE, known)
    away = solved_again(before, HEAD.surface, -BESIDE, known)
    assert there.solved.left < before.solved.left < away.solved.left


def test_places_leave_less_and_markers_that_are_not_filmed_stay() -> None:
    before = on_vertices(BESIDE, slice(3, None))
    after = with_places(
        before, guess_in_image(before.solved.head.rest[:, :2], before.solved.film.face), known
    )
    assert after.solved.left < before.solved.left
    off = np.linalg.norm(after.shifts - BESIDE, axis=1)[3:]
    assert off.mean() < 0.5 * np.linalg.norm(BESIDE, axis=1)[3:].mean()
    assert not after.shifts[:3].any()


def test_a_step_that_leaves_more_is_not_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    module = import_module("usdface.retarget.film.placed_film")
    monkeypatch.setattr(module, "refined_shifts", lambda *_, search: BESIDE)
    before = on_vertices(NONE)
    face = before.solved.film.face
    assert with_places(before, guess_in_image(face[:, :2], face), known) is before
