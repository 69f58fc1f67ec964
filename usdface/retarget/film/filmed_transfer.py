"""Blend shapes of the performer's own face in a film, transferred from the character's."""

from dataclasses import replace
from functools import partial

from usdface.arrays import FloatArray, IntArray
from usdface.face.marker_surface import MarkerSurface
from usdface.face.transferred_shapes import transferred_surface
from usdface.retarget.film.solve_film import SolvedFilm, SolveOnSkin, solve_film

__all__ = ["with_transferred_shapes"]

# Alternations of poses and weights with other shapes, from those of the character.
_ROUNDS = 3


def with_transferred_shapes(
    solved: SolvedFilm,
    surface: MarkerSurface,
    bound: IntArray,
    shifts: FloatArray,
    solve: SolveOnSkin,
) -> tuple[SolvedFilm, MarkerSurface]:
    """Return a film as solved with the performer's own shapes, and the skin that moves so.

    Both are as they were where these shapes leave more of the film than the character's.

    Parameters
    ----------
    solved : SolvedFilm
        With the markers at these places.
    surface : MarkerSurface
        Of the character around all bound markers.
    bound : (M,) int64
        Those of the film.
    shifts : (B, 3) float64 [m]
        Of the places from the vertices.
    solve : callable
    """
    own = surface.select(bound)
    other = transferred_surface(own, own.at(shifts[bound]), solved.head.rest)
    if other is None:
        return solved, surface
    performed = surface.with_shapes(other.mesh.shapes)
    skin = performed.at(shifts).skin
    again = solve_film(
        replace(solved.film, skin=skin.select(bound)), solved.head.camera, partial(solve, skin),
        _ROUNDS, solved, errors=solved.head.errors,
    )  # fmt: skip
    return (again, performed) if again.left < solved.left else (solved, surface)
