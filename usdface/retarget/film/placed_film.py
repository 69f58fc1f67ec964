"""A film solved with markers beside their vertices, at places that leave less of it."""

from dataclasses import dataclass, replace
from functools import partial

from usdface.arrays import FloatArray, IntArray
from usdface.face.dot_skin import DotSkin
from usdface.face.marker_surface import MarkerSurface
from usdface.retarget.film.filmed_places import refined_shifts
from usdface.retarget.film.solve_film import SolvedFilm, SolveOnSkin, solve_film
from usdface.retarget.places import PlaceGuess

__all__ = ["PlacedFilm", "solved_again", "with_places"]

# Times that places are refined, at most, and the alternations of poses and weights after each.
_PLACE_STEPS = 8
_ROUNDS = 3
# Places are refined again where the last step left a hundredth less of the take, at least. Whole
# steps, with a search for single markers, may lead too far; then come such shares of steps without.
_LOWER = 0.01
_SHARE = 0.25


@dataclass(frozen=True, eq=False, slots=True)
class PlacedFilm:
    """A film as solved with its markers at some places of a face.

    Attributes
    ----------
    solved : SolvedFilm
    surface : MarkerSurface
        Of the face around all B bound markers.
    bound : (M,) int64
        Those of the film.
    shifts : (B, 3) float64 [m]
        Of the places from the vertices.
    """

    solved: SolvedFilm
    surface: MarkerSurface
    bound: IntArray
    shifts: FloatArray

    @property
    def skin(self) -> DotSkin:
        """Under all bound markers."""
        return self.surface.at(self.shifts).skin


def solved_again(
    placed: PlacedFilm, surface: MarkerSurface, shifts: FloatArray, solve: SolveOnSkin
) -> PlacedFilm:
    """Return a film as solved on another surface at other places, from its last poses and weights.

    Parameters
    ----------
    placed : PlacedFilm
    surface : MarkerSurface
        Around the same B bound markers.
    shifts : (B, 3) float64 [m]
    solve : callable
    """
    before, skin = placed.solved, surface.at(shifts).skin
    film = replace(before.film, skin=skin.select(placed.bound))
    after = solve_film(
        film, before.head.camera, partial(solve, skin), _ROUNDS, before, errors=before.head.errors
    )
    return replace(placed, solved=after, surface=surface, shifts=shifts)


def with_places(placed: PlacedFilm, guess: PlaceGuess, solve: SolveOnSkin) -> PlacedFilm:
    """Return a film as solved with places that leave less of it.

    Parameters
    ----------
    placed : PlacedFilm
        With the markers at some places, on their vertices for instance.
    guess : PlaceGuess
        Of its M markers.
    solve : callable
    """
    surface, bound, share = placed.surface, placed.bound, 1.0
    own = surface.select(bound)
    for _ in range(_PLACE_STEPS):
        before, shifts = placed.solved, placed.shifts
        whole = refined_shifts(before, shifts[bound], guess, own, search=share == 1.0)
        there = shifts.copy()
        there[bound] += share * (whole - shifts[bound])
        again = solved_again(placed, surface, there, solve)
        if again.solved.left < before.left:
            placed = again
        if again.solved.left > (1.0 - _LOWER) * before.left:
            if share < 1.0:
                break
            share = _SHARE
    return placed
