"""Blend shapes of the filmed performer's own face, on a smooth head before a camera."""

from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest
from filmed import CAMERA, filmed_markers
from skins import make_head

from usdface.arrays import FloatArray
from usdface.face.dot_skin import DotSkin
from usdface.face.marker_surface import MarkerSurface
from usdface.retarget.film.film_head import film_head
from usdface.retarget.film.filmed_take import FilmedTake
from usdface.retarget.film.filmed_transfer import with_transferred_shapes
from usdface.retarget.film.placed_film import PlacedFilm, solved_again
from usdface.retarget.film.solve_film import SolvedFilm, SolveOnSkin, solve_film

HEAD = make_head()
SURFACE = HEAD.surface
PATCH = SURFACE.patch
BOUND = np.arange(len(HEAD.vertices))
NONE = np.zeros((len(BOUND), 3))


def bend(points: FloatArray) -> FloatArray:
    return np.asarray(points * [1.05, 0.97, 1.15] + 0.002 * np.sin(25 * points[:, [1, 2, 0]]))


CHARACTERS = HEAD.mesh.offsets_at(HEAD.vertices)
OWN = PATCH.transferred(bend(PATCH.points), HEAD.mesh.offsets_at(PATCH.vertices))[
    :, PATCH.place_of[HEAD.vertices]
]


def known(*_: object) -> FloatArray:
    return HEAD.weights


def solved(skin: DotSkin, rest: FloatArray, offsets: FloatArray) -> SolvedFilm:
    """A film of a performer's markers (M, 3) that blend shapes (S, M, 3) move."""
    take = filmed_markers(rest + np.einsum("fs,smd->fmd", HEAD.weights, offsets), 20.0, noise=0.2)
    film = FilmedTake(take, skin, (0, 9), lambda shapes: shapes, 0.0)
    return solve_film(film, CAMERA, known, 10)


def placed(surface: MarkerSurface, offsets: FloatArray, shifts: FloatArray = NONE) -> PlacedFilm:
    """The bent face, moved by these blend shapes, as solved with markers at these places."""
    film = solved(surface.at(shifts).skin, bend(HEAD.points), offsets)
    return PlacedFilm(film, surface, BOUND, shifts)


def at_markers(surface: MarkerSurface) -> FloatArray:
    return np.asarray(surface.mesh.offsets_at(surface.vertices))


def test_of_another_face_the_shapes_are_its_own_where_these_leave_less() -> None:
    before = placed(SURFACE, OWN)
    after = with_transferred_shapes(before, known)
    assert after.solved.left < before.solved.left
    off = np.abs(at_markers(after.surface) - OWN).mean()
    assert off < 0.6 * np.abs(CHARACTERS - OWN).mean()
    np.testing.assert_array_equal(after.surface.mesh.points, HEAD.mesh.points)


def test_places_that_only_made_up_for_the_characters_shapes_are_given_up() -> None:
    before = placed(SURFACE, OWN, HEAD.beside(0.001, seed=3))
    after = with_transferred_shapes(before, known)
    assert after.solved.left < before.solved.left and after.surface is not SURFACE
    assert not after.shifts.any()


def test_of_another_face_that_moves_as_the_character_nothing_changes() -> None:
    before = placed(SURFACE, CHARACTERS)
    assert with_transferred_shapes(before, known) is before


def test_a_mesh_without_faces_keeps_its_shapes() -> None:
    none = np.zeros(0, np.int64)
    bare = replace(HEAD.mesh, face_counts=none, face_indices=none)
    before = placed(MarkerSurface(bare, HEAD.vertices), OWN)
    assert with_transferred_shapes(before, known) is before


@pytest.mark.parametrize("size", [1.0, pytest.param(0.3, marks=pytest.mark.slow)])
def test_blend_shapes_that_leave_more_than_the_map_are_not_used(
    size: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The map's places stay on the vertices: it leaves more than true shapes, less than small."""

    def transferred(placed: PlacedFilm, solve: SolveOnSkin) -> PlacedFilm:
        shapes = tuple(replace(each, offsets=size * each.offsets) for each in SURFACE.mesh.shapes)
        return solved_again(placed, SURFACE.with_shapes(shapes), placed.shifts, solve)

    module = import_module("usdface.retarget.film.film_head")
    monkeypatch.setattr(module, "with_transferred_shapes", transferred)
    steps = module.with_places
    monkeypatch.setattr(
        module,
        "with_places",
        lambda film, *more: film if film.solved.film.mapped else steps(film, *more),
    )
    beside = HEAD.beside(0.001, seed=3)
    take = filmed_markers(HEAD.performed(beside), 20.0, noise=0.2)
    found, _ = film_head(take, take.names, SURFACE, (0, 9), known, weighted=False)
    assert found is not None and found.head.mapped == (size < 1.0)
