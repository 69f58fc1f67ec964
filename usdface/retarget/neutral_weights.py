"""Blend shape weights of the neutral frames of a performer.

A performer's neutral may have weights above 0, such as half closed lids or pressed lips.
Displacements are relative to it, so where a weight falls below its neutral value they need a
negative one. The neutral weights are the fewest and smallest with which every frame is explained by
weights of 0 or more. Weights that the frames hardly need stay 0: two people's faces differ.
"""

from collections.abc import Mapping

import numpy as np

from usdface.arrays import FloatArray
from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.findings import Finding, finding
from usdface.findings.values import Prose
from usdface.geometry.marker_spread import rms_radius
from usdface.geometry.rigid_fit import similarity_fit
from usdface.retarget.motion_model import MotionModel
from usdface.retarget.neutral import on_plane
from usdface.retarget.neutral_cost import NeutralCost
from usdface.retarget.pose_and_weights import PoseAndWeights
from usdface.retarget.windows import window_starts
from usdface.setup.retarget_setup import RetargetSetup

__all__ = [
    "LARGEST",
    "estimate_neutral_weights",
    "neutral_weight_findings",
    "weights_at_limit",
    "without_weights",
]

# Frames are averaged over windows of this length [s]; a short take is divided into so many. Noise
# lifts bounded weights off 0 in short windows, in long ones the face moves.
_WINDOW, _WINDOWS = 0.4, 20
_FEWEST_WINDOWS = 10  # of fewer a mean says little
# As a share of the face's size, the RMS radius of its markers: how far performer and rig differ in
# the mean of a window, beside the misfit that the take shows (0.2 mm on the ICT face).
_ERROR = 0.0033
# L1 penalty on a neutral weight, by the mean cost of a window, and the weight that costs half as
# much in the second solve (E. Candes, M. Wakin, S. Boyd, "Enhancing Sparsity by Reweighted l1
# Minimization", 2008). Of 6 and 12, and 0.02 and 0.05, on performers 1 to 4 with seven neutrals: 12
# finds nothing in those that show nothing.
_COST = 12.0
_RELIEF = 0.02
# Neutral weights count if the mean cost of a window falls by this at least. With neutrals that were
# chosen by eye (AnimFace's Jaw and Eyebrows on three heads, in space and filmed) it falls by 0.45
# at most; where the neutral shows a mouth open by 0.1, or seven to ten shapes at 0.05 to 0.15, by
# 0.7 to 12 on a rig that makes the performer's movements.
_WORTH = 0.7
# Another rig's misfit may resemble a blend shape: then by such a share of what is left unexplained,
# too. Of neutrals that show nothing, at most 0.25 (a performer who presses the chin up for 20 s, on
# MakeHuman; 21 others, on MakeHuman, the example and ICT, 0.22); of a mouth open by 0.1, 0.8 and
# more on MakeHuman and ICT, 0.16 to 0.37 on the example; of ten shapes at 0.05, 0.63 to 1.4 on ICT.
_RESEMBLES = 0.3
# Weights that few windows need, by those in which the face moves, are a movement that the rig does
# not make: nearly all movements leave an expression of the neutral. Of neutrals that show nothing,
# jaws of the example and of ICT need one in 0.31 to 0.43 of those windows; weights that show, in
# 0.50 and more (performers 1 to 4; expressions of twenty others, whose neutrals show three shapes).
# Smaller ones are not judged: they save little more than noise does, and do little harm.
_NEEDED, _JUDGED = 0.46, 0.06
LARGEST = 0.5  # more than half of a shape is no neutral
_SOLVES = 2
# Weights are saved to three decimals.
_ROUNDING = 6e-4
_NAMED = 3  # blend shapes that a message names
_LEAST = 0.01  # smaller ones change nothing that is seen


def estimate_neutral_weights(
    times: FloatArray,
    solved: PoseAndWeights,
    motion: MotionModel,
    errors: FloatArray | None,
) -> FloatArray:
    """Estimate the weights of the face in the neutral frames: (S,) in [0, 0.5].

    A convex problem: the bounded weights of the neutral and of the take, in means over short
    windows, that explain the displacements from neutral, with an L1 penalty. Inbetweens count by
    their projection on their shape; combination shapes are 0. All 0 in takes that are too short.

    Parameters
    ----------
    times : (F,) float64 [s]
    solved : PoseAndWeights
        The take, solved without a correction of the neutral.
    motion : MotionModel
        That it was solved with.
    errors : (M,) float64 [1], optional
        Of the markers (`usdface.retarget.marker_errors`); equal, if left out.
    """
    cost, unlike = _in_errors(times, solved, motion, errors)
    found = np.zeros(len(motion.shapes.offsets))
    if len(cost.moved) < _FEWEST_WINDOWS or not cost.offsets.any():
        return found
    found[motion.shapes.free] = _shown(cost, unlike)
    return found


def _shown(cost: NeutralCost, unlike: float) -> FloatArray:
    """Return the neutral weights (P,) that lower the cost by enough and in enough windows."""
    none = neutral = np.zeros(len(cost.offsets))
    largest = np.full(len(none), LARGEST)
    while largest.any():
        penalty = np.full(len(none), _COST)
        for _ in range(_SOLVES):
            neutral = cost.minimised(neutral, penalty, largest)
            penalty = _COST * _RELIEF / (neutral + _RELIEF)
        neutral = np.where(neutral < _LEAST, 0.0, neutral)
        saved = cost.mean(none) - cost.mean(neutral)
        if saved < max(_WORTH, _RESEMBLES * unlike * cost.unexplained(neutral)):
            return none
        needed = np.where(neutral < _JUDGED, np.inf, cost.needed_in(neutral))
        rarest = int(needed.argmin())
        if needed[rarest] >= _NEEDED:
            return neutral
        largest[rarest] = 0.0  # one at a time: another may be rare only beside it
    return none


def _in_errors(
    times: FloatArray,
    solved: PoseAndWeights,
    motion: MotionModel,
    errors: FloatArray | None,
) -> tuple[NeutralCost, float]:
    """Return the cost of neutral weights, of N = axes * M, and the misfit's share of its error.

    Of free shapes, without the head's motion if it moves; the share is that of the variance.
    """
    model, seen = motion.shapes, motion.coordinates
    moved, frames = _windows(times, solved, model)
    moved, shapes = moved[:, seen], model.offsets[model.free][:, seen]
    own = 1.0 if errors is None else np.repeat(errors, motion.axes)
    moved, shapes = moved / own, shapes / own
    if motion.moving_head:
        rigid = motion.head_basis(errors)
        moved, shapes = (each - (each @ rigid) @ rigid.T for each in (moved, shapes))
    lasting = solved.regularisation.lasting_variance
    still = solved.regularisation.noise**2 / frames + (_ERROR * rms_radius(motion.points)) ** 2
    # Misfit is in proportion to motion: windows in which the face rests are surest.
    ways = (moved**2).sum(axis=1)
    precision = 1.0 / (still + lasting * ways / max(float(ways.mean()), 1e-30))
    error = np.sqrt(still + lasting)
    unlike = lasting / (still + lasting)
    return NeutralCost(moved / error, shapes / error, precision / precision.sum()), unlike


def _windows(
    times: FloatArray, solved: PoseAndWeights, model: BlendShapeEvaluator
) -> tuple[FloatArray, float]:
    """Return mean displacements (W, 3 M) [m] over windows of a take, and their number of frames.

    Occluded markers are where the weights have them.
    """
    predicted = model.displacements(solved.weights)
    moved = solved.displaced.reshape(predicted.shape)
    moved = np.where(np.isnan(moved), predicted, moved)
    span = max(float(times[-1] - times[0]), 1e-9)
    length = min(_WINDOW, span / _WINDOWS)
    starts = window_starts(times, length)
    counts = np.diff(np.append(starts, len(times)))
    return np.add.reduceat(moved, starts) / counts[:, None], float(np.median(counts))


def weights_at_limit(
    weights: Mapping[str, float], model: BlendShapeEvaluator, shape_names: tuple[str, ...]
) -> tuple[str, ...]:
    """Return the shapes whose neutral weight is `LARGEST`, or is as far along its inbetweens.

    More of them may show. Larger weights are none of an estimate.
    """
    linear = np.full((1, len(shape_names)), LARGEST)
    limits = dict(zip(shape_names, model.from_linear(linear)[0], strict=True))
    return tuple(n for n, weight in weights.items() if abs(weight - limits[n]) < _ROUNDING)


def neutral_weight_findings(
    setup: RetargetSetup, model: BlendShapeEvaluator, shape_names: tuple[str, ...], source: str
) -> list[Finding]:
    """Report the weights that the neutral frames of a take were found to show."""
    weights = setup.neutral_weights
    shown = sorted(weights, key=lambda name: -weights[name])
    message = (
        "the neutral frames show {shape_count} blend shapes (most: {most}), which are subtracted "
        "from the neutral and stay there as weights; "
        'usdface:solve:neutral = "given" takes the frames as they are'
    )
    most = Prose(", ".join(f"{name} {weights[name]:.2f}" for name in shown[:_NAMED]))
    found = finding("NEUTRAL_SHOWS", source, message, len(shown), most, shapes=shown)
    cut = weights_at_limit(weights, model, shape_names)
    if not cut:
        return [found]
    message = (
        "the neutral frames show an expression ({shapes}) that is larger than the part that is "
        "subtracted; name frames in which the face rests"
    )
    return [found, finding("NEUTRAL_AT_LIMIT", source, message, [*cut[:_NAMED]])]


def without_weights(neutral: FloatArray, points: FloatArray, shown: FloatArray) -> FloatArray:
    """Return the performer's neutral (M, D) without the displacements of its neutral weights.

    Parameters
    ----------
    neutral : (M, D) float64
        The neutral in one head pose.
    points : (M, 3) float64 [m]
        The markers' places on the neutral character.
    shown : (M, 3) float64 [m]
        Displacements of the neutral weights on the character.
    """
    axes = neutral.shape[1]
    linear, _ = similarity_fit(on_plane(neutral), on_plane(points[:, :axes]))
    return np.asarray(neutral - shown[:, :axes] @ np.linalg.inv(linear[:axes, :axes]))
