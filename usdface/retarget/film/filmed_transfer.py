"""Blend shapes of the performer's own face in a film, transferred from the character's."""

import numpy as np

from usdface.face.transferred_shapes import transferred_surface
from usdface.retarget.film.placed_film import PlacedFilm, solved_again
from usdface.retarget.film.solve_film import SolveOnSkin

__all__ = ["with_transferred_shapes"]


def with_transferred_shapes(placed: PlacedFilm, solve: SolveOnSkin) -> PlacedFilm:
    """Return a film as solved with the performer's own blend shapes.

    It is as it was where these leave more of the film than the character's. Markers are at the
    places that were found, or on their vertices: some places only make up for the character's
    blend shapes.

    Parameters
    ----------
    placed : PlacedFilm
    solve : callable
    """
    best, surface, bound = placed, placed.surface, placed.bound
    own = surface.select(bound)
    for shifts in (placed.shifts, np.zeros_like(placed.shifts)):
        other = transferred_surface(own, own.at(shifts[bound]), placed.solved.head.rest)
        if other is None:
            break
        again = solved_again(placed, surface.with_shapes(other.mesh.shapes), shifts, solve)
        if again.solved.left < best.solved.left:
            best = again
    return best
