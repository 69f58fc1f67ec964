"""The head motion in a take of one camera, solved together with the weights.

An image has no depth, but the character does: its neutral and its blend shapes give every marker a
third coordinate. With it the head pose is fitted by a perspective camera, and the weights are
solved in the view of each image, alternately (`usdface.retarget.film.solve_film`). Where the head
turns, the depths of the performer's own face are estimated, too, then its blend shapes, and the
places of the markers on the skin.
"""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.face.dot_skin import DotSkin
from usdface.face.marker_surface import MarkerSurface
from usdface.findings import Finding, finding
from usdface.retarget.film.filmed_errors import filmed_marker_errors
from usdface.retarget.film.filmed_head import FilmedHead
from usdface.retarget.film.filmed_take import FilmedTake, Sized, as_they_are
from usdface.retarget.film.filmed_transfer import with_transferred_shapes
from usdface.retarget.film.focal_length import film_camera
from usdface.retarget.film.one_camera import PinholeCamera
from usdface.retarget.film.placed_film import PlacedFilm, with_places
from usdface.retarget.film.solve_film import SolveOnSkin, solve_film
from usdface.retarget.marker_errors import LARGE_ERROR, marker_error_findings
from usdface.retarget.neutral import neutral_markers
from usdface.retarget.places import MOST_MARKERS, guess_in_image
from usdface.takes import MarkerTake, visible

__all__ = ["FEWEST_FILMED", "FilmedFace", "film_head"]

# Alternations of poses and weights, at most.
_ROUNDS = 10
# Rounds over all frames, started from the displacements of a sample.
_LAST_ROUNDS = 3
# Frames sampled for the depths: a bound on time.
_FRAMES = 600
# Least number of markers, for the six parameters of a pose and a face.
FEWEST_FILMED = 6


@dataclass(frozen=True, eq=False, slots=True)
class FilmedFace:
    """A head before a camera, and the places of its markers on the character.

    Attributes
    ----------
    head : FilmedHead
    skin : DotSkin
        Of the character around all B bound markers.
    shifts : (B, 3) float64 [m]
        Of the markers from their vertices.
    """

    head: FilmedHead
    skin: DotSkin
    shifts: FloatArray


def film_head(
    take: MarkerTake,
    markers: tuple[str, ...],
    surface: MarkerSurface,
    neutral: tuple[int, int],
    solve: SolveOnSkin,
    *,
    sized: Sized = as_they_are,
    refined: bool = True,
    transferred: bool = True,
    weighted: bool = True,
    shown: FloatArray | float = 0.0,
) -> tuple[FilmedFace | None, list[Finding]]:
    """Find the motion of a head before the camera that filmed it.

    Parameters
    ----------
    take : MarkerTake
        2D.
    markers : tuple of str, length B
        The bound markers.
    surface : MarkerSurface
        Of the character around each of them.
    neutral : (int, int)
        First and last neutral frame index, inclusive.
    solve : callable
        Solves a take of a still head with these neutral frames, for weights of the skin's
        evaluator.
    sized : callable
        Makes of the character's blend shapes those of a calibrated performer.
    refined : bool
        Markers may sit beside their vertices.
    transferred : bool
        Blend shapes may be transferred to the performer's face, if `refined`.
    weighted : bool
        Markers that move unlike the face around them get less weight.
    shown : (M, 2) float64 [px], or 0
        Displacements of the M markers of the film in its neutral frames, by weights that they show.

    Returns
    -------
    FilmedFace or None
        None where fewer than six markers are in the take and its neutral frames.
    list of Finding
    """
    known = [k for k, name in enumerate(markers) if name in take.names]
    image = take.select(tuple(markers[k] for k in known))
    rest = neutral_markers(image, neutral)
    used = np.flatnonzero(visible(rest) & visible(image).any(axis=0))
    if len(used) < FEWEST_FILMED:
        message = (
            "{marker_count} markers are in the take and its neutral frames; from {wanted_count} on "
            "the head turns before a camera, with fewer it moves in the image alone"
        )
        return None, [finding("HEAD_IN_PLANE", take.source, message, len(used), FEWEST_FILMED)]
    bound = np.array(known)[used]
    own = np.array([take.names.index(markers[k]) for k in bound.tolist()])
    film = FilmedTake(take.with_markers(own), surface.skin.select(bound), neutral, sized, shown)
    camera, findings = film_camera(film, partial(solve, surface.skin))
    on_skin = partial(
        _on_skin, film.part(_FRAMES), camera, surface, bound, solve,
        refined=refined and len(bound) <= MOST_MARKERS, transferred=transferred,
    )  # fmt: skip
    errors = np.ones(len(bound))
    placed = on_skin(errors)
    found = filmed_marker_errors(placed.solved) if weighted else errors
    if (found > LARGE_ERROR).any():
        placed = on_skin(found)
        # A part of the errors was hidden by the effect of these markers on the places of all.
        errors = filmed_marker_errors(placed.solved)
        placed = _solved_last(placed, placed.solved.film, solve, errors)
    if len(placed.solved.weights) < len(film.image):
        placed = _solved_last(placed, film, solve, errors, refined=False)
    findings += marker_error_findings(errors, film.take.names, take.source)
    return FilmedFace(placed.solved.head, placed.skin, placed.shifts), findings


def _on_skin(
    film: FilmedTake,
    camera: PinholeCamera,
    surface: MarkerSurface,
    bound: IntArray,
    solve: SolveOnSkin,
    errors: FloatArray,
    *,
    refined: bool,
    transferred: bool,
) -> PlacedFilm:
    """Solve a film, with places and blend shapes that leave less of it.

    Parameters are those of `film_head` and `solve_film`.
    """
    on_vertices = partial(solve, surface.skin)
    none = np.zeros((len(surface.vertices), 3))
    solved = solve_film(film, camera, on_vertices, _ROUNDS, errors=errors)
    placed = PlacedFilm(solved, surface, bound, none)
    if not refined:
        return placed
    guess = guess_in_image(solved.head.rest[:, :2], film.face)
    if guess.on_vertices(surface):
        return placed
    placed = with_places(placed, guess, solve)
    if not transferred:
        return placed
    # Transferred blend shapes move as the performer's do: no map bends them once more.
    straight = solve_film(replace(film, mapped=False), camera, on_vertices, _ROUNDS, errors=errors)
    own = with_places(PlacedFilm(straight, surface, bound, none), guess, solve)
    performed = with_transferred_shapes(own, solve)
    # Where they explain no more than the character's own, the performer moves as the character.
    if performed is own:
        return placed
    performed = with_places(performed, guess, solve)
    return min(placed, performed, key=lambda each: each.solved.left)


def _solved_last(
    placed: PlacedFilm,
    film: FilmedTake,
    solve: SolveOnSkin,
    errors: FloatArray,
    *,
    refined: bool = True,
) -> PlacedFilm:
    """Return a film as solved at its last places, in all frames of `film`.

    Parameters are those of `film_head` and `solve_film`.
    """
    before = placed.solved
    own = replace(film, skin=before.film.skin, mapped=before.film.mapped)
    solved = solve_film(
        own, before.head.camera, partial(solve, placed.skin), _LAST_ROUNDS, before,
        errors=errors, refined=refined,
    )  # fmt: skip
    return replace(placed, solved=solved)
