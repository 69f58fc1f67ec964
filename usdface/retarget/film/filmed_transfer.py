"""Blend shapes of the performer's own face in a film, transferred from the character's."""

from dataclasses import replace
from functools import partial

import numpy as np

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
) -> tuple[SolvedFilm, MarkerSurface, FloatArray]:
    """Return a film as solved with the performer's own shapes, the skin that moves so, and places.

    All are as they were where these shapes leave more of the film than the character's. Markers are
    at the given places, or on their vertices: some places only make up for the character's shapes.

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
    best, own = (solved, surface, shifts), surface.select(bound)
    for places in (shifts, np.zeros_like(shifts)):
        other = transferred_surface(own, own.at(places[bound]), solved.head.rest)
        if other is None:
            return best
        performed = surface.with_shapes(other.mesh.shapes)
        skin = performed.at(places).skin
        again = solve_film(
            replace(solved.film, skin=skin.select(bound)), solved.head.camera,
            partial(solve, skin), _ROUNDS, solved, errors=solved.head.errors,
        )  # fmt: skip
        if again.left < best[0].left:
            best = again, performed, places
    return best
