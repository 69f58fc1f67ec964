"""The camera of a take: its focal length, given or by the motion of the head."""

import numpy as np

from usdface.arrays import FloatArray
from usdface.findings import Finding, finding
from usdface.retarget.film.filmed_take import FilmedTake
from usdface.retarget.film.one_camera import PinholeCamera
from usdface.retarget.film.solve_film import SolveProjected, solve_film
from usdface.takes import MarkerTake

__all__ = ["film_camera", "usual_camera"]

# Assumed diagonal of an image of unknown size, by the face's size in it.
_AROUND = 4.0
# Focal lengths that are tried, in diagonals of the image: 22 to 170 mm on 35 mm film;
# between them a parabola in the logarithm is fitted. Rounds and frames of each trial.
_FOCAL_LENGTHS = np.array([0.5, 0.8, 1.25, 2.0, 4.0])
_TRIAL_ROUNDS = 3
_TRIAL_FRAMES = 200
# Focal length where the take does not determine it, and it hardly matters: 28 mm on 35 mm film, as
# of phones.
_USUAL = 0.65
# The focal length counts as determined where the largest residual of those tried is this many times
# the least. Of six films of another performer (python -m benchmarks.one_camera) the three below
# were found 1.4 to 4.5 times too long, the three above at most 1.3 times: the misfit of another
# face resembles a lens error.
_SHOWN = 1.2
# Residuals up to this [px] are rounding, as of a single image: they show no focal length.
_ROUNDING = 1e-6


def film_camera(film: FilmedTake, solve: SolveProjected) -> tuple[PinholeCamera, list[Finding]]:
    """Return the camera, by the take's focal length or by one estimated from its motion."""
    take, findings = film.take, list[Finding]()
    if not take.image_size:
        findings.append(finding("IMAGE_SIZE_ASSUMED", take.source))
    if take.focal_length:
        return usual_camera(take, film.rest), findings
    diagonal, centre = _frame(take, film.rest)
    some = film.part(_TRIAL_FRAMES)
    lengths = _FOCAL_LENGTHS * diagonal
    errors = np.array(
        [
            solve_film(some, PinholeCamera(length, centre), solve, _TRIAL_ROUNDS).left
            for length in lengths
        ]
    )
    determined = bool(errors.max() > max(_SHOWN * errors.min(), _ROUNDING))
    length = _lowest(lengths, errors) if determined else _USUAL * diagonal
    code = "FOCAL_LENGTH_FOUND" if determined else "FOCAL_LENGTH_ASSUMED"
    findings.append(finding(code, take.source, "{focal_length_px:.0f} px", length))
    return PinholeCamera(length, centre), findings


def usual_camera(take: MarkerTake, markers: FloatArray) -> PinholeCamera:
    """Return the camera by the take's focal length, or by that of phones where it has none.

    Parameters
    ----------
    take : MarkerTake
        Of an image.
    markers : (M, 2) float64 [px]
        A typical face in the image, by which an image of unknown size is guessed.
    """
    diagonal, centre = _frame(take, markers)
    return PinholeCamera(take.focal_length or _USUAL * diagonal, centre)


def _frame(take: MarkerTake, markers: FloatArray) -> tuple[float, FloatArray]:
    """Return diagonal and centre of the image [px], by the markers where they are unknown."""
    if take.image_size:
        return float(np.hypot(*take.image_size)), 0.5 * np.array(take.image_size) * [1.0, -1.0]
    size = float(np.linalg.norm(np.ptp(markers, axis=0)))
    return _AROUND * size, np.asarray(markers.mean(axis=0))


def _lowest(lengths: FloatArray, errors: FloatArray) -> float:
    """Return the minimum of a parabola through the least error and its neighbours."""
    middle = int(np.clip(errors.argmin(), 1, len(errors) - 2))
    around = slice(middle - 1, middle + 2)
    places = np.log(lengths[around])
    bend, slope, _ = np.polyfit(places, np.log(errors[around]), 2)
    if bend <= 0.0:
        return float(lengths[errors.argmin()])
    return float(np.exp(np.clip(-0.5 * slope / bend, places[0], places[-1])))
