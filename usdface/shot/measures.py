"""The measures of a verdict: figures of a retargeted shot, and the places that they come from."""

import numpy as np

from usdface.arrays import FloatArray
from usdface.errors import SolveError
from usdface.face.bound_face import BoundFace
from usdface.face.head_size import size_by_eyes
from usdface.face.lip_lid_contacts import find_lip_lid_contacts
from usdface.geometry.marker_spread import rms_radius
from usdface.geometry.rigid_fit import mean_scale, similarity_fit
from usdface.numerics.frame_blocks import frame_blocks
from usdface.retarget.shape_reach import beyond_reach
from usdface.retarget.solution import Solution
from usdface.shot.neutral_measures import neutral_at_limit, neutral_expressive
from usdface.shot.performance_measures import (
    STILL,
    idle_curves,
    performance_short,
    still_markers,
    still_weights,
)
from usdface.shot.shot import ShotResult
from usdface.takes import MarkerTake, WeightsTake, visible
from usdface.verdict.criteria import CRITERIA
from usdface.verdict.judge import Measured

__all__ = ["shot_measures"]

_NAMED = 4  # places that a reason names
_LIMIT = 0.999
# Proposed places of a lower confidence are unsure, and none is flatter than this.
_SURE, _FLATTEST = 0.5, 0.01
# Values of a block of frames, markers and shapes: 64 MB.
_VALUES = 2**23
# Farthest that a face is taken to move its skin beyond the character's blend shapes [m], in human
# size; anything farther away is no motion of a face but of its head, or of a lost marker. Set by
# hand: above the forehead of AnimFace's Eyebrows (8 to 10.5 mm; its brows move by 8 to 16.5, of
# which a rig makes a part), below the motion of a head that is left in the take (18 mm).
_FARTHEST = 0.012
# One marker lies far more beside its vertex than the others: by more than this times their median.
# Set by hand: at most 2.8 on takes bound well where a marker lies 5 mm or more beside its vertex.
_ALONE = 3.0
_MISFIT = next(each.look_at for each in CRITERIA if each.code == "PLACES_MISFIT")
# A shape rests open by this percentile of its weight: it is above that in nine tenths of the take.
_OPEN = 10.0


def shot_measures(
    result: ShotResult, ratios: dict[str, float], deviation: float = np.nan
) -> dict[str, Measured]:
    """Measure a retargeted shot by the criteria of `usdface.verdict`.

    Parameters
    ----------
    result : ShotResult
    ratios : dict of str to float
        Travel ratio of each region (`usdface.retarget.travel`); without those not determined.
    deviation : float
        Median standard deviation of the weights; NaN where it is unknown.

    Returns
    -------
    dict of str to Measured
        By code; without the codes that do not apply to the shot.
    """
    found = _of_weights(result)
    take = result.shot.take
    found["PERFORMANCE_SHORT"] = performance_short(take.times)
    if isinstance(take, WeightsTake):
        found["PERFORMANCE_STILL"] = still_weights(take)
        found["CURVES_IDLE"] = idle_curves(take, result.shot.rig.shape_names, result.shot.setup)
    elif result.solution is not None:
        found |= _of_markers(result, take, result.solution)
        found["SHAPES_UNDETERMINED"] = Measured(deviation)
        found |= _of_travel(ratios)
    return {code: measured for code, measured in found.items() if np.isfinite(measured.value)}


def _of_weights(result: ShotResult) -> dict[str, Measured]:
    names, weights = result.solved.names, result.solved.weights
    if not names:
        return {}
    limit = (weights >= _LIMIT).mean(axis=0)
    still_open = np.percentile(weights, _OPEN, axis=0)
    return {
        "WEIGHTS_AT_LIMIT": _worst("shapes", names, limit),
        "SHAPE_RESTS_OPEN": _worst("shapes", names, still_open),
    }


def _of_markers(result: ShotResult, take: MarkerTake, solution: Solution) -> dict[str, Measured]:
    face, markers = result.shot.face, solution.markers
    size = size_by_eyes(face.mesh.points, find_lip_lid_contacts(face.mesh).lids)
    human_mm = 1000.0 / size if np.isfinite(size) else 1000.0
    away = _rms_distances(solution)
    motion = _rms_motion(solution)
    noise = np.sqrt(3.0) * solution.noise
    seen = visible(take.positions)[:, [take.names.index(name) for name in markers]]
    occluded = 1.0 - seen.mean(axis=0)
    found = {
        "NOISE_LARGE": Measured(_share(noise, motion)),
        "MARKER_ASTRAY": _worst("markers", markers, human_mm * away),
        "MARKERS_OCCLUDED": Measured(float(occluded.mean()), "markers", _most(markers, occluded)),
        "NEUTRAL_AT_LIMIT": neutral_at_limit(result.shot.setup, solution, face),
        "BINDING_UNSURE": _unsure(result),
    }
    radius = rms_radius(solution.rest)
    found["PERFORMANCE_STILL"] = still_markers(motion, radius)
    if motion**2 - noise**2 > (STILL * radius) ** 2:
        farthest = 1000.0 * _FARTHEST / human_mm
        found |= _of_motion(solution, face, motion, noise, farthest)
        found["NEUTRAL_EXPRESSIVE"] = neutral_expressive(result.shot, solution, motion)
    beside = human_mm * np.linalg.norm(solution.shifts, axis=1)
    found["PLACES_BESIDE"] = Measured(float(np.median(beside)), "markers", _most(markers, beside))
    if solution.dimension == 3:
        found |= _of_rest(solution, face, size)
    return found


def _of_motion(
    solution: Solution, face: BoundFace, motion: float, noise: float, farthest: float
) -> dict[str, Measured]:
    """Measure the motion that the shapes leave unexplained, and that no weights of them reach.

    Motion beyond their reach counts against neither the solve nor the binding: it is subtracted
    from the distances and off the motion.
    """
    markers, shapes = solution.markers, face.mesh.offsets_at(face.vertices_of(solution.markers))
    errors = 1.0 if solution.errors is None else solution.errors
    beyond, reached, missed, seen = np.zeros((4, len(markers)))
    size = max(1, _VALUES // max(shapes.size, 1))
    for frames in frame_blocks(len(solution.residual), size):
        displaced, away = solution.displaced(frames), solution.distances[frames]
        # Their reach is that at the vertices; the markers are solved where they sit.
        short = np.fmin(beyond_reach(displaced, shapes), np.fmin(away, farthest))
        beyond += (short**2).sum(axis=0)
        reached += ((np.linalg.norm(displaced, axis=2) - short) ** 2).sum(axis=0)
        missed += np.nansum((np.maximum(away - short, 0.0) / errors) ** 2, axis=0)
        seen += (~np.isnan(away)).sum(axis=0)
    unexplained = np.sqrt(max(missed.sum() / max(seen.sum(), 1.0) - noise**2, 0.0))
    rms_beyond, rms_reached = (
        np.sqrt(max(sums.sum() / solution.distances.size - own, 0.0))
        for sums, own in ((beyond, noise**2), (reached, 0.0))
    )
    return {
        "MOTION_UNEXPLAINED": Measured(
            _share(unexplained, rms_reached), "markers", _most(markers, missed)
        ),
        "MOTION_BEYOND_SHAPES": Measured(
            _share(rms_beyond, motion), "markers", _most(markers, beyond)
        ),
    }


def _of_rest(solution: Solution, face: BoundFace, size: float) -> dict[str, Measured]:
    """Measure the misfit of resting markers and character under the best similarity."""
    at = face.mesh.points[face.vertices_of(solution.markers)]
    try:
        beside, scale = _similarity_residuals(solution.neutral, at)
        mirrored, _ = _similarity_residuals(solution.neutral * [-1.0, 1.0, 1.0], at)
    except SolveError:  # all markers at one place
        return {}
    off = float(np.sqrt((beside**2).mean()))
    misfit = _share(off, rms_radius(at))
    worst = Measured(np.nan)
    # Beyond its own limit the misfit of all names the marker.
    if misfit < _MISFIT and beside.max() > _ALONE * float(np.median(beside)):
        worst = _worst("markers", solution.markers, 1000.0 * beside / size)
    return {
        "PLACE_WRONG": worst,
        "PLACES_MISFIT": Measured(misfit, "markers", _most(solution.markers, beside)),
        "SIDES_MIRRORED": Measured(_share(off, float(np.sqrt((mirrored**2).mean())))),
        "RIG_SIZE": _unusual(size),
        "TAKE_SIZE": _unusual(size / scale if scale else np.nan),
    }


def _similarity_residuals(source: FloatArray, target: FloatArray) -> tuple[FloatArray, float]:
    """Return the residual distances (M,) of the best similarity, and its scale."""
    linear, offset = similarity_fit(source, target)
    distances = np.linalg.norm(source @ linear + offset - target, axis=1)
    return distances, mean_scale(linear)


def _unusual(size: float) -> Measured:
    """Return how many times as large or as small as usual."""
    if not size > 0:
        return Measured(np.nan)
    return Measured(max(size, 1.0 / size), "size", ("large",) if size >= 1.0 else ("small",))


def _rms_motion(solution: Solution) -> float:
    """Return the RMS displacement of the markers [m]."""
    squares = [
        (solution.displaced(frames) ** 2).sum(axis=2).sum()
        for frames in frame_blocks(len(solution.residual))
    ]
    return float(np.sqrt(sum(squares) / solution.distances.size))


def _rms_distances(solution: Solution) -> FloatArray:
    """Return the RMS distance of each marker from the face as solved: (M,) [m]; NaN if unseen."""
    sums, counts = np.zeros((2, len(solution.markers)))
    for frames in frame_blocks(len(solution.residual)):
        own = solution.distances[frames]
        sums += np.nansum(own**2, axis=0)
        counts += (~np.isnan(own)).sum(axis=0)
    means = np.full(len(sums), np.nan)
    return np.asarray(np.sqrt(np.divide(sums, counts, out=means, where=counts > 0)))


def _unsure(result: ShotResult) -> Measured:
    setup = result.shot.setup
    left_out = setup.unsure.markers
    confidence = setup.binding.confidence
    low = () if confidence is None else np.flatnonzero(confidence < _SURE)
    unsure = (*left_out, *(setup.binding.markers[i] for i in low))
    count = len(setup.binding.markers) + len(left_out)
    return Measured(_share(len(unsure), count), "markers", unsure[:_NAMED])


def _of_travel(ratios: dict[str, float]) -> dict[str, Measured]:
    if not ratios:
        return {}
    region = min(ratios, key=ratios.__getitem__)
    return {"REGION_FLAT": Measured(1.0 / max(ratios[region], _FLATTEST), "regions", (region,))}


def _share(part: float, whole: float) -> float:
    return float(part / whole) if whole else np.nan


def _worst(kind: str, names: tuple[str, ...], values: FloatArray) -> Measured:
    """Return the largest value, and its name; NaN counts only where all are."""
    worst = int(np.where(np.isnan(values), -np.inf, values).argmax())
    return Measured(float(values[worst]), kind, (names[worst],))


def _most(names: tuple[str, ...], values: FloatArray) -> tuple[str, ...]:
    """Return the names of the largest values."""
    return tuple(names[i] for i in np.argsort(-values, kind="stable")[:_NAMED].tolist())
