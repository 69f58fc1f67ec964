"""The markers that features are measured on, of the whole face and of either half.

Either the take's own, or those of the solved character, which move as far as the take's do. A half
is mirrored to the other side.
"""

from collections.abc import Callable, Sequence

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.correction.motion_gain import LEAST_MOTION, motion_gains, motion_products
from usdface.errors import InputError
from usdface.face.bound_face import BoundFace
from usdface.face.mirror import Side, half_face, half_weights, marker_sides, midline
from usdface.face.symmetry import symmetric_pairs
from usdface.numerics.frame_blocks import by_blocks
from usdface.retarget.neutral import on_plane
from usdface.retarget.pins import pin_nearness
from usdface.retarget.recorded_gaze import gaze_shapes
from usdface.retarget.solution import Solution
from usdface.setup.pin import Pin
from usdface.takes import MarkerTake, WeightsTake, frame_step

__all__ = ["Positions", "SidedMarkers", "character_markers", "take_markers"]

# Width of the Gaussian [s] over which motion is compared; as the features' own.
_GAIN_WIDTH = 0.2

# Positions (B, M, 3) of markers in some frames.
Positions = Callable[[slice], FloatArray]
# Names of markers, their neutral positions (M, 3), and their positions for each side.
SidedMarkers = tuple[tuple[str, ...], FloatArray, dict[Side, Positions]]


def take_markers(
    face: BoundFace,
    take: MarkerTake | WeightsTake,
    solution: Solution | None,
    sides: Sequence[Side],
) -> SidedMarkers:
    """Return the take's own markers.

    Raises
    ------
    InputError
        If the take has weights only.
    """
    if solution is None or not isinstance(take, MarkerTake):
        raise InputError(
            "the fuzzy system reads the take's markers, but the take has weights only; "
            'set its space to "character"'
        )
    names, neutral = solution.markers, on_plane(solution.neutral)
    still, on_character = solution.still(take), face.mesh.points[face.vertices_of(names)]
    by_side = _sided_positions(
        lambda frames: still[frames], neutral, on_character, names, face.nose_tip, sides
    )
    return names, neutral, by_side


def character_markers(
    face: BoundFace,
    weights: WeightsTake,
    solution: Solution | None,
    sides: Sequence[Side],
    pins: Sequence[Pin],
) -> SidedMarkers:
    """Return the markers on the solved character, their motion scaled to that of the take."""
    names, neutral = face.markers, face.neutral
    solved = weights.reordered(face.shape_names)
    bent = _bent_by_pins(face, solved, pins)
    if len(symmetric_pairs(face.shape_names)):
        by_side = {side: _scaled_positions(face, solved, solution, side, bent) for side in sides}
    else:
        positions = _scaled_positions(face, solved, solution, "both", bent)
        by_side = _sided_positions(positions, neutral, neutral, names, face.nose_tip, sides)
    return names, neutral, by_side


def _sided_positions(
    positions: Positions,
    neutral: FloatArray,
    on_character: FloatArray,
    names: tuple[str, ...],
    nose_tip: str,
    sides: Sequence[Side],
) -> dict[Side, Positions]:
    """Return the positions of each side; without a nose tip, those of the whole face for all."""
    if nose_tip not in names:
        return dict.fromkeys(sides, positions)
    nose = names.index(nose_tip)

    def of(side: Side) -> Positions:
        return lambda frames: half_face(positions(frames), neutral, on_character, nose, side)

    return {side: positions if side == "both" else of(side) for side in sides}


def _scaled_positions(
    face: BoundFace, solved: WeightsTake, solution: Solution | None, side: Side, bent: BoolArray
) -> Positions:
    """Return a side's markers on the solved character, their motion scaled to that of the take.

    The lower and the upper half in frames that are `bent` (F, 2) are not compared with the take.
    """
    pairs = symmetric_pairs(face.shape_names)

    def moved(frames: slice) -> FloatArray:
        own = solved.weights[frames]
        return face.displacements(own if side == "both" else half_weights(own, pairs, side))

    if solution is None or face.nose_tip not in solution.markers:
        return lambda frames: face.neutral + moved(frames)
    upper = _upper(face)
    gains, half = _gains(face, solved, solution, side, bent), upper.astype(np.intp)

    def scaled(frames: slice) -> FloatArray:
        at = moved(frames)
        nose = at[:, face.nose, None]
        return np.asarray(face.neutral + (nose + gains[frames][:, half, None] * (at - nose)))

    return scaled


def _gains(
    face: BoundFace, solved: WeightsTake, solution: Solution, side: Side, bent: BoolArray
) -> FloatArray:
    """Return by how much the lower and the upper half move further than solved: (F, 2)."""
    index = {name: i for i, name in enumerate(solution.markers)}
    used = np.array([name in index for name in face.markers])
    at = [index[name] for name in np.array(face.markers)[used]]
    sides = marker_sides(face.neutral, midline(face.neutral, face.midline))
    measured = used if side == "both" else used & (sides != (-1 if side == "left" else 1))

    def products(frames: slice) -> FloatArray:
        own = face.displacements(solved.weights[frames])
        recorded = own.copy()
        recorded[:, used] = solution.feature_points[frames][:, at] - solution.rest[at]
        own, recorded = (each - each[:, face.nose, None] for each in (own, recorded))
        return motion_products(own, recorded, _upper(face), measured)

    times = solved.times
    step = frame_step(times) if len(times) > 1 else 1.0
    unbent = by_blocks(len(times), products) * ~bent[..., None]
    return motion_gains(unbent, _GAIN_WIDTH / step, face.size)


def _upper(face: BoundFace) -> BoolArray:
    """Return the markers above the nose tip: (M,)."""
    return np.asarray(face.neutral[:, 1] > face.neutral[face.nose, 1])


def _bent_by_pins(face: BoundFace, solved: WeightsTake, pins: Sequence[Pin]) -> BoolArray:
    """Return in which frames pins bend the motion of the lower and the upper half: (F, 2).

    A half is bent by blend shapes that move its markers by more than the least motion that counts;
    not by those of gaze, which a recorder may have pinned in all frames.
    """
    bent = np.zeros((len(solved.times), 2), dtype=bool)
    gaze = gaze_shapes(solved.names) if pins else ()
    pins = [pin for pin in pins if pin.shape not in gaze]
    if not pins or face.nose_tip not in face.markers:
        return bent
    near = pin_nearness(pins, solved.names, solved.times) > 0.0
    pinned = near.any(axis=0)
    moved = face.displacements(np.eye(len(solved.names))[pinned])
    squares = ((moved - moved[:, face.nose, None]) ** 2).sum(axis=2)
    for half, own in enumerate((~_upper(face), _upper(face))):
        if own.any():
            moving = squares[:, own].mean(axis=1) > (face.size * LEAST_MOTION) ** 2
            bent[:, half] = near[:, pinned][:, moving].any(axis=1)
    return bent
