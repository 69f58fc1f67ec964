"""The RBF paper's map from an image to a character's feature points, compared with the default one.

Source: Troy, Pranowo, Gunanto, "2D to 3D Space Transformation for Facial Animation Based on Marker
Data", InAES 2016, equations 5 to 10; the quantities are those of its Table I.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from usdface.arrays import FloatArray, freeze
from usdface.blas_threads import one_blas_thread
from usdface.errors import InputError
from usdface.face.bound_face import BoundFace
from usdface.face.curve_mapping import rename_weights
from usdface.findings import Finding
from usdface.numerics.rms import rms
from usdface.numerics.solve_errors import solve_errors
from usdface.options import MapOptions
from usdface.retarget.neutral import neutral_markers
from usdface.retarget.rbf import fit_paper_map
from usdface.retarget_take.clean import clean
from usdface.retarget_take.solve import solve
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake, WeightsTake, visible

__all__ = ["ImagePoints", "WayScore", "compare_ways"]

# The names of the ways, as tables show them.
_PAPER, _SOLVED, _DEFAULT = "paper", "paper, solved", "default"


@dataclass(frozen=True, eq=False, slots=True)
class WayScore:
    """Errors of feature points [mm] and weights [1] of one way; NaN without a reference.

    `frame` and `largest` are of the test frame, `film` is of all frames; RMS distances.
    """

    name: str
    frame: float
    largest: float
    film: float
    weights: float


@dataclass(frozen=True, eq=False, slots=True)
class ImagePoints:
    """The quantities of Table I for a film: M markers, at rest and in the test frame.

    Attributes
    ----------
    markers : tuple of str, length M
    test_frame : int
    radius : float [px]
        Of the paper's kernel: the least distance of two markers (equation 7).
    train_source, test_source : (M, 2) float64 [px]
        Markers in the neutral frames and in the test frame, x right, y down; NaN = occluded.
    train_target : (M, 3) float64 [m]
        Feature points of the character at rest.
    points : dict of str to (M, 3) float64 [m]
        Feature points in the test frame by each way, and of the reference, if there is one.
    scores : tuple of WayScore
    """

    markers: tuple[str, ...]
    test_frame: int
    radius: float
    train_source: FloatArray
    test_source: FloatArray
    train_target: FloatArray
    points: dict[str, FloatArray]
    scores: tuple[WayScore, ...]

    def __post_init__(self) -> None:
        freeze(self, "train_source", "test_source", "train_target")

    @property
    def errors(self) -> dict[str, FloatArray]:
        """Distance (M,) [m] of each way's points from the reference; empty without one."""
        if "reference" not in self.points:
            return {}
        true = self.points["reference"]
        return {
            name: np.linalg.norm(points - true, axis=1)
            for name, points in self.points.items()
            if name != "reference"
        }

    def as_dict(self) -> dict[str, Any]:
        """Return plain values for JSON: pixels and millimetres; None = occluded or not known."""
        return {
            "test_frame": self.test_frame,
            "radius_px": _plain(self.radius),
            "markers": list(self.markers),
            "train_source_px": _plain(self.train_source),
            "test_source_px": _plain(self.test_source),
            "train_target_mm": _plain(1000 * self.train_target),
            "points_mm": {name: _plain(1000 * points) for name, points in self.points.items()},
            "errors_mm": {name: _plain(1000 * error) for name, error in self.errors.items()},
            "ways": {
                score.name: {
                    "test_frame_rms_mm": _plain(score.frame),
                    "test_frame_largest_mm": _plain(score.largest),
                    "film_rms_mm": _plain(score.film),
                    "weights_rms": _plain(score.weights),
                }
                for score in self.scores
            },
        }


def _plain(values: FloatArray | float) -> Any:
    """Return nested lists, rounded; None in place of NaN."""
    if isinstance(values, np.ndarray):
        return [_plain(value) for value in values] if values.ndim else _plain(float(values))
    return None if np.isnan(values) else round(float(values), 4)


@one_blas_thread()
@solve_errors()
def compare_ways(
    take: MarkerTake,
    face: BoundFace,
    setup: RetargetSetup,
    *,
    reference: WeightsTake | None = None,
    test_frame: int | None = None,
) -> tuple[ImagePoints, list[Finding]]:
    """Map the markers of a film to a character by the paper's map, and by the default method.

    The paper's way is its equations 5 to 10 with the multiquadric and one radius for the whole face
    on the markers as the image shows them. "Solved" are the weights that the solve finds with that
    map; the default way is that of `process`, without its correction.

    Parameters
    ----------
    take : MarkerTake
        Of an image.
    face : BoundFace
        Of the setup's binding.
    setup : RetargetSetup
        With neutral frames: the training pair.
    reference : WeightsTake, optional
        The performed weights of the face's blend shapes: the errors are against their points.
    test_frame : int, optional
        By default that in which most of the face moves most.

    Raises
    ------
    InputError
        If the take is no image's, its markers are not bound, there are no neutral frames, or the
        test frame is not in the take.
    """
    if take.dimension != 2 or setup.neutral is None:
        raise InputError(
            f"{take.source}: the RBF paper's map needs a take of an image and neutral frames in "
            "its binding",
            "TAKE_KIND_WRONG",
        )
    frames = len(take.times)
    if test_frame is not None and not 0 <= test_frame < frames:
        raise InputError(
            f"there is no frame {test_frame} in {take.source}: it has the frames 0 to {frames - 1}",
            "FRAMES_OUTSIDE",
        )
    names, source = _neutral_dots(take, face, setup.neutral)
    bound = [face.markers.index(name) for name in names]
    image = take.select(names)
    target = face.neutral[bound]
    space = fit_paper_map(source, target)
    cleaned, findings = clean(take, setup)
    default = setup.map if setup.map.form != "paper" else MapOptions()
    solved = {}
    for way, options in (
        (_SOLVED, MapOptions(form="paper", kernel="multiquadric")),
        (_DEFAULT, default),
    ):
        own = replace(setup, map=options)
        solution, found = solve(cleaned.take, face, own, cleaned=cleaned)
        solved[way] = solution.weights
    points = {_PAPER: space(image)}
    points |= {way: _points(face, weights)[:, bound] for way, weights in solved.items()}
    true = None
    if reference is not None:
        true = _at_times(rename_weights(reference, face.shape_names)[0], take.times)
        points["reference"] = _points(face, true)[:, bound]
    if test_frame is None:
        moved = np.linalg.norm(points[_DEFAULT if true is None else "reference"] - target, axis=2)
        test_frame = int(np.argmax(np.where(visible(image), moved, 0.0).mean(axis=1)))
    return ImagePoints(
        markers=names,
        test_frame=test_frame,
        radius=space.radius,
        train_source=source * [1, -1],
        test_source=image[test_frame] * [1, -1],
        train_target=target,
        points={name: values[test_frame] for name, values in points.items()},
        scores=tuple(_score(name, points, test_frame, solved.get(name), true) for name in _WAYS),
    ), [*findings, *found]


def _neutral_dots(
    take: MarkerTake, face: BoundFace, frames: tuple[int, int]
) -> tuple[tuple[str, ...], FloatArray]:
    """Return the bound markers that are seen in the neutral frames, and where: names, (M, 2)."""
    known = [name for name in face.markers if name in take.names]
    rest = neutral_markers(take.select(tuple(known)), frames)
    names = tuple(name for name, seen in zip(known, visible(rest), strict=True) if seen)
    if len(names) < 3:
        raise InputError(
            f"{take.source}: {len(names)} bound markers are seen in the neutral frames; expected "
            "three or more (name the dots as the binding does)",
            "MARKERS_TOO_FEW",
        )
    return names, rest[visible(rest)]


_WAYS = (_PAPER, _SOLVED, _DEFAULT)


def _points(face: BoundFace, weights: WeightsTake) -> FloatArray:
    """Return the feature points (F, B, 3) [m] of weights."""
    own = weights.reordered(face.shape_names).weights
    return np.asarray(face.neutral + face.displacements(own))


def _at_times(weights: WeightsTake, times: FloatArray) -> WeightsTake:
    columns = [np.interp(times, weights.times, column) for column in weights.weights.T]
    return replace(weights, times=times, weights=np.stack(columns, axis=1))


def _score(
    name: str,
    points: dict[str, FloatArray],
    frame: int,
    weights: WeightsTake | None,
    reference: WeightsTake | None,
) -> WayScore:
    if reference is None:
        return WayScore(name, *[float("nan")] * 4)
    away = 1000 * np.linalg.norm(points[name] - points["reference"], axis=2)
    off = float("nan")
    if weights is not None:
        shared = [shape for shape in reference.names if shape in weights.names]
        own, true = weights.reordered(tuple(shared)), reference.reordered(tuple(shared))
        off = rms(own.weights - true.weights)
    shown = rms(away[frame], empty=np.nan)
    return WayScore(name, shown, float(np.nanmax(away[frame])), rms(away, empty=np.nan), off)
