"""Labelled examples from takes: every take is retargeted, every stretch is one example."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from usdface.arrays import FloatArray, IntArray, freeze
from usdface.correction.feature_extraction import features
from usdface.correction.features import measure
from usdface.errors import InputError
from usdface.expression_system import ExpressionSystem, MarkerFeature
from usdface.face.bound_face import BoundFace
from usdface.findings import Finding
from usdface.fuzzy.system import FuzzySystem
from usdface.fuzzy.variables import Variable
from usdface.geometry.marker_spread import marker_spread
from usdface.numerics.seen_mean import seen_mean
from usdface.options import LEARNED_SMOOTHING, MARKER_NOISE, FeatureSpace, FitOptions
from usdface.progress import Progress
from usdface.retarget.solution import Solution
from usdface.retarget_take.clean_and_solve import clean_and_solve
from usdface.rule_design.design import face_features
from usdface.rule_design.feature_noise import solved_noise
from usdface.rule_design.marker_roles import direction_names, known_roles, marker_features
from usdface.rule_design.movements import single_movements
from usdface.rule_learning.examples import NO_EMOTION, Examples
from usdface.rule_learning.labels import NEUTRAL, Label
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["Labelled", "examples_of", "feature_noise", "pose_features"]

# Apex: the frames of a stretch that move at least this share of the most expressive one. Chosen by
# hand: above half, so that onset and offset are left out, and low enough to average over noise.
_PEAK = 0.8
# Least noise of a feature after the solve, as a share of a marker's: rules are about visible
# motions. Chosen by hand, no experiment (docs/constants.md).
_LEAST_NOISE = 0.5

ReadTake = Callable[[Path], tuple[MarkerTake | WeightsTake, list[Finding]]]


@dataclass(frozen=True, eq=False, slots=True)
class Labelled:
    """Examples with the weights that were solved for them.

    Attributes
    ----------
    examples : Examples
    weights : (N, S) float64
        At the apex of the expression.
    shape_names : tuple of str, length S
    """

    examples: Examples
    weights: FloatArray
    shape_names: tuple[str, ...]

    def __post_init__(self) -> None:
        freeze(self, "weights")


def examples_of(
    labels: Sequence[Label],
    face: BoundFace,
    setup: RetargetSetup,
    *,
    read: ReadTake,
    options: FitOptions,
    progress: Progress,
) -> tuple[Labelled, list[Finding]]:
    """Retarget every labelled take, and measure its stretches at their apex.

    The first stretch labelled `neutral` is the neutral of its take, else that of the setup.

    Parameters
    ----------
    labels : sequence of Label
    face : BoundFace
    setup : RetargetSetup
        How the takes are retargeted.
    read : callable
        From a path to a take.
    options : FitOptions
        Where features are measured, and whether they are the paper's, without sign.
    progress : Progress

    Raises
    ------
    InputError
        If a take cannot be read or solved, or does not have the labelled frames.
    """
    columns = marker_features(_roles(face), "absolute" if options.paper else "signed")
    paths = list(dict.fromkeys(label.take for label in labels))
    labels = sorted(labels, key=lambda label: paths.index(label.take))
    rows, weights, findings = [], [], []
    for path in paths:
        own = [label for label in labels if label.take == path]
        with progress.step(f"retarget {path.name}"):
            take, new_findings = read(path)
            findings += new_findings
            apex, solved, new_findings = _stretches(take, own, face, setup, options.space, columns)
        rows.append(apex)
        weights.append(solved)
        findings += new_findings
    examples = Examples(
        marker_features=columns,
        direction_names=direction_names(face.neutral, face.nose),
        features=np.concatenate(rows),
        emotions=tuple(label.emotion if label.is_emotion else NO_EMOTION for label in labels),
        variants=tuple(label.variant for label in labels),
        recordings=tuple(str(label.take) for label in labels),
        intensities=np.array([label.intensity for label in labels]),
        noise=feature_noise(face, options.space),
        movements=pose_features(single_movements(face.shape_names), face, columns),
    )
    if not examples.names:
        raise InputError("the labels name no emotion; without one there is nothing to learn")
    return Labelled(examples, np.concatenate(weights), face.shape_names), findings


def _stretches(
    take: MarkerTake | WeightsTake,
    labels: Sequence[Label],
    face: BoundFace,
    setup: RetargetSetup,
    space: FeatureSpace,
    columns: tuple[MarkerFeature, ...],
) -> tuple[FloatArray, FloatArray, list[Finding]]:
    """Return features (N, I) and weights (N, S) of one take's stretches."""
    frames = [_frames(label, take) for label in labels]
    rest = [f for f, label in zip(frames, labels, strict=True) if label.emotion == NEUTRAL]
    if rest:
        setup = replace(setup, neutral=(int(rest[0][0]), int(rest[0][-1])))
    take, weights, solution, findings = clean_and_solve(take, face, setup)
    weights = weights.reordered(face.shape_names)
    measured = _features(take, weights, solution, face, space, columns)
    is_neutral = [label.emotion == NEUTRAL for label in labels]

    def at_apex(values: FloatArray) -> list[FloatArray]:
        rows = [values[f] for f in frames]
        return [r if rest else r[_apex(r)] for r, rest in zip(rows, is_neutral, strict=True)]

    # Each at its own apex: features are smoothed over time, weights are not.
    return (
        np.array([seen_mean(rows) for rows in at_apex(measured)]),
        np.array([rows.mean(axis=0) for rows in at_apex(weights.weights)]),
        findings,
    )


def _features(
    take: MarkerTake | WeightsTake,
    weights: WeightsTake,
    solution: Solution | None,
    face: BoundFace,
    space: FeatureSpace,
    columns: tuple[MarkerFeature, ...],
) -> FloatArray:
    """Measure every marker along every axis: (F, I); NaN for markers that the take lacks."""
    face = replace(face, roles=_roles(face))
    available = set(solution.markers if solution and space == "take" else face.markers)
    known = [face.roles[column.role] in available for column in columns]
    read = tuple(column for column, yes in zip(columns, known, strict=True) if yes)
    inputs = FuzzySystem(tuple(Variable(column.name, "input") for column in read), ())
    all_features = ExpressionSystem(inputs, read, space=space, smoothing=LEARNED_SMOOTHING)
    measured = np.full((len(take.times), len(columns)), np.nan)
    measured[:, known] = features(all_features, face, take, weights=weights, solution=solution)
    return measured


def _frames(label: Label, take: MarkerTake | WeightsTake) -> IntArray:
    """Return the frame indices of a stretch."""
    last = len(take.times) - 1
    moments = np.arange(last + 1) if label.unit == "frame" else take.times
    found = np.flatnonzero((moments >= label.start - 1e-9) & (moments <= label.end + 1e-9))
    # A frame lasts until the next one: 12 s at 60 frames a second end 1/60 s after the last.
    lasts = np.diff(take.times).max(initial=0.0) if label.unit == "s" else 0.0
    if not found.size or label.end > moments[-1] + lasts + 1e-9:
        raise InputError(
            f"{label.take}: {label.emotion} is labelled from {label.start:g} to {label.end:g} "
            f"[{label.unit}], but the take has frames 0 to {last}, 0 to {take.times[-1]:g} s"
        )
    return found


def _apex(rows: FloatArray) -> IntArray:
    """Return the indices of the most expressive of `rows` (F, I)."""
    size = np.sqrt(np.nansum(rows**2, axis=1))
    return np.flatnonzero(size >= _PEAK * size.max())


def pose_features(
    weights: FloatArray, face: BoundFace, columns: tuple[MarkerFeature, ...]
) -> FloatArray:
    """Measure poses of the rig, weights (N, S): (N, I) [face unit]."""
    return measure(
        face.neutral + face.displacements(weights),
        face.neutral,
        face.markers,
        columns,
        _roles(face),
        face.nose_tip,
        marker_spread(face.neutral),
    )


def _roles(face: BoundFace) -> dict[str, str]:
    """Return role to marker, for every bound marker."""
    return known_roles(face.markers, face.roles)


def feature_noise(face: BoundFace, space: FeatureSpace) -> FloatArray:
    """Return the noise of every feature with optical markers: (3 M,) [face unit].

    On the take it is that of two markers, on the character the noise that remains after the solve,
    with a lower limit: rules are to be about visible motions.
    """
    unit, noise = marker_spread(face.neutral), face.size * MARKER_NOISE
    if space == "take":
        return np.full(3 * len(face.neutral), np.sqrt(2.0) * noise / unit)
    solved = solved_noise(face.evaluator.offsets, face_features(face).offsets, noise)
    return np.maximum(solved, _LEAST_NOISE * noise) / unit
