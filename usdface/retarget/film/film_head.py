"""The head motion in a take of one camera, solved together with the weights.

An image has no depth, but the character does: its neutral and its blend shapes give every marker a
third coordinate. With it the head pose is fitted by a perspective camera, and the weights are
solved in the view of each image, alternately (`usdface.retarget.film.solve_film`). Where the head
turns, the depths of the performer's own face are estimated, too, and then the places of the markers
on the skin.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.face.dot_skin import DotSkin
from usdface.face.marker_surface import MarkerSurface
from usdface.findings import Finding, finding
from usdface.retarget.film.filmed_errors import filmed_marker_errors
from usdface.retarget.film.filmed_head import FilmedHead
from usdface.retarget.film.filmed_places import refined_shifts
from usdface.retarget.film.filmed_take import FilmedTake, Sized, as_they_are
from usdface.retarget.film.focal_length import film_camera
from usdface.retarget.film.one_camera import PinholeCamera
from usdface.retarget.film.solve_film import SolvedFilm, solve_film
from usdface.retarget.film.views import Views
from usdface.retarget.marker_errors import LARGE_ERROR, marker_error_findings
from usdface.retarget.neutral import neutral_markers
from usdface.retarget.places import MOST_MARKERS, guess_in_image
from usdface.takes import MarkerTake, visible

__all__ = ["FEWEST_FILMED", "FilmedFace", "SolveOnSkin", "film_head"]

# Alternations of poses and weights, at most.
_ROUNDS = 10
# Rounds over all frames, started from the displacements of a sample.
_LAST_ROUNDS = 3
# Frames sampled for the depths: a bound on time.
_FRAMES = 600
# Least number of markers, for the six parameters of a pose and a face.
FEWEST_FILMED = 6
# Times that places are refined, at most, and the alternations after each.
_PLACE_STEPS = 8
_PLACE_ROUNDS = 3
# Places are refined again where the last step left a hundredth less of the take, at least. Whole
# steps, with a search for single markers, may lead too far; then come such shares of steps without.
_LOWER = 0.01
_SHARE = 0.25
# Markers are on their vertices if they err by less than this share of the face's size at rest.
_EXACT = 1e-6

# Solves the weights (F, S) of a take as the camera projects it, by the skin under all bound
# markers, its views and neutral frames.
SolveOnSkin = Callable[[DotSkin, MarkerTake, Views, tuple[int, int]], FloatArray]


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
    weighted: bool = True,
    shown: FloatArray | float = 0.0,
) -> tuple[FilmedFace | None, list[Finding]]:
    """Find how a head moved before the camera that filmed it.

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
    skin = surface.skin
    film = FilmedTake(take.with_markers(own), skin.select(bound), neutral, sized, shown)
    camera, findings = film_camera(film, partial(solve, skin))
    errors = np.ones(len(bound))
    solved, skin, shifts = _on_skin(film, camera, surface, bound, solve, errors, refined)
    found = filmed_marker_errors(solved) if weighted else errors
    if (found > LARGE_ERROR).any():
        errors = found
        solved, skin, shifts = _on_skin(film, camera, surface, bound, solve, errors, refined)
        # A part of the errors was hidden by what these markers did to the places of all.
        errors = filmed_marker_errors(solved)
        solved = solve_film(
            solved.film, camera, partial(solve, skin), _LAST_ROUNDS, solved, errors=errors
        )
    if len(solved.weights) < len(film.image):
        solved = solve_film(
            replace(film, skin=skin.select(bound)), camera, partial(solve, skin), _LAST_ROUNDS,
            solved, errors=errors, refined=False,
        )  # fmt: skip
    findings += marker_error_findings(errors, film.take.names, take.source)
    return FilmedFace(solved.head, skin, shifts), findings


def _on_skin(
    film: FilmedTake,
    camera: PinholeCamera,
    surface: MarkerSurface,
    bound: IntArray,
    solve: SolveOnSkin,
    errors: FloatArray,
    refined: bool,
) -> tuple[SolvedFilm, DotSkin, FloatArray]:
    """Solve some frames of a film; return them, the skin under its markers, and their shifts.

    Parameters are those of `film_head`, `_with_places` and `solve_film`.
    """
    skin, shifts = surface.skin, np.zeros((len(surface.vertices), 3))
    solved = solve_film(film.part(_FRAMES), camera, partial(solve, skin), _ROUNDS, errors=errors)
    if refined and len(bound) <= MOST_MARKERS:
        return _with_places(solved, surface, bound, solve)
    return solved, skin, shifts


def _with_places(
    solved: SolvedFilm, surface: MarkerSurface, bound: IntArray, solve: SolveOnSkin
) -> tuple[SolvedFilm, DotSkin, FloatArray]:
    """Return a film as solved with places that leave less of it, the skin there, and the shifts.

    Parameters
    ----------
    solved : SolvedFilm
        With the markers on their vertices.
    surface : MarkerSurface
        Around all bound markers.
    bound : (M,) int64
        Those of the film.
    solve : callable
    """
    skin, own, shifts = surface.skin, surface.select(bound), np.zeros((len(surface.vertices), 3))
    guess = guess_in_image(solved.head.rest[:, :2], solved.film.face)
    if guess.spread <= _EXACT * surface.reach:
        return solved, skin, shifts
    share = 1.0
    for _ in range(_PLACE_STEPS):
        whole = refined_shifts(solved, shifts[bound], guess, own, search=share == 1.0)
        there = shifts.copy()
        there[bound] += share * (whole - shifts[bound])
        moved = surface.at(there).skin
        again = solve_film(
            replace(solved.film, skin=moved.select(bound)), solved.head.camera,
            partial(solve, moved), _PLACE_ROUNDS, solved, errors=solved.head.errors,
        )  # fmt: skip
        before = solved.left
        if again.left < before:
            solved, skin, shifts = again, moved, there
        if again.left > (1.0 - _LOWER) * before:
            if share < 1.0:
                break
            share = _SHARE
    return solved, skin, shifts
