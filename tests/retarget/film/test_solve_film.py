from dataclasses import replace

import numpy as np
from filmed import CAMERA, NEUTRAL, VERTICES, WORLD, filmed, true_weights

from usdface.arrays import FloatArray
from usdface.retarget.film.filmed_take import FilmedTake
from usdface.retarget.film.solve_film import SolvedFilm, solve_film
from usdface.retarget.film.views import Views
from usdface.takes import MarkerTake

TAKE, MOTION = filmed(WORLD, 20.0)
FILM = FilmedTake(TAKE, VERTICES, NEUTRAL)


def known(take: MarkerTake, views: Views, neutral: tuple[int, int]) -> FloatArray:
    return true_weights(VERTICES, take, views, neutral)


def solved(rounds: int, start: SolvedFilm | None = None, *, refined: bool = True) -> SolvedFilm:
    return solve_film(FILM, CAMERA, known, rounds, start, refined=refined)


def with_depths(film: SolvedFilm, depths: FloatArray) -> SolvedFilm:
    rest = np.c_[film.head.rest[:, :2], depths]
    return replace(film, head=replace(film.head, rest=rest))


def test_true_weights_leave_nothing() -> None:
    film = solved(10)
    assert film.left < 1e-4
    np.testing.assert_array_equal(film.weights, WORLD.weights)


def test_a_good_guess_needs_one_round() -> None:
    assert solved(1, solved(10)).left < 1e-4 < 1.0 < solved(1).left


def test_depths_stay_as_they_are_given_unless_they_are_refined() -> None:
    deep = VERTICES.rest[:, 2] + 0.004 * np.random.default_rng(1).normal(size=len(VERTICES.rest))
    start = with_depths(solved(10), deep)
    kept = solved(3, start, refined=False)
    np.testing.assert_allclose(kept.depths, deep)
    refined = solved(6, start)
    assert refined.left < 0.1 * kept.left


def test_weights_at_other_times_lie_between_those_of_the_frames() -> None:
    film, times = solved(3), TAKE.times
    between = film.weights_at(0.5 * (times[1:] + times[:-1]))
    np.testing.assert_allclose(between, 0.5 * (film.weights[1:] + film.weights[:-1]), atol=1e-12)
    np.testing.assert_array_equal(film.weights_at(times), film.weights)
