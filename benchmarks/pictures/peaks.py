"""Frames of a result that are worth a look: peaks, corrections, blinks, held poses."""

from collections.abc import Iterable, Iterator

import numpy as np
from scipy.ndimage import median_filter
from scipy.signal import find_peaks

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.blend_shape_evaluator import evaluator_of
from usdface.face.lip_lid_contacts import find_lip_lid_contacts
from usdface.face.regions import regions_of
from usdface.rigs import Mesh
from usdface.shot import ShotResult

__all__ = ["peak_frames"]

VERTICES = 800  # of the skin that are looked at
APART = 0.4  # s; frames nearer to each other look alike
REST = 0.0005  # m; a face that moves less rests, a correction that moves less is none
BLINK = 0.3  # s, longest
CLOSING = 0.001  # m, least of a blink, lid to lid
HELD = 0.5  # s, least
STILL = 0.1  # of the pose's size per second
CORRECTIONS, BLINKS, HELD_POSES = 4, 3, 2
POSES, FEW = {"mouth": 4, "jaw": 4, "brows": 3}, 2  # of a region; of the others


def peak_frames(result: ShotResult) -> dict[int, str]:
    """Return the frames to look at in order, each with its reason."""
    mesh, times = result.shot.mesh, result.solved.times
    vertices = _skin(mesh)
    raw = displacements(result, mesh, vertices, result.solved.weights)
    corrected = displacements(result, mesh, vertices, result.weights.weights)
    found: dict[int, str] = {}
    for frame, reason in (
        *_rest(raw),
        *_blinks(result),
        *_corrections(raw, corrected, times),
        *_poses(mesh, vertices, raw),
        *_held(raw, times),
    ):
        near = (other for other in found if abs(times[other] - times[frame]) < APART)
        first = next(near, None)
        if first is None:
            found[frame] = reason
        elif reason not in found[first]:
            found[first] += f", {reason}"
    return dict(sorted(found.items()))


def displacements(
    result: ShotResult, mesh: Mesh, vertices: IntArray, weights: FloatArray
) -> FloatArray:
    """Return displacements of vertices of the bound mesh from neutral: (F, N, 3) [m]."""
    names = result.solved.names
    columns = [names.index(name) for name in mesh.shape_names]
    evaluator, _ = evaluator_of(mesh, vertices)
    moved = evaluator.displacements(evaluator.combined(weights[:, columns]))
    return moved.reshape(len(weights), len(vertices), 3)


def _skin(mesh: Mesh) -> IntArray:
    """Return vertices that blend shapes move, evenly thinned out."""
    moved = np.unique(np.concatenate([shape.indices for shape in mesh.shapes]))
    return moved[:: max(1, len(moved) // VERTICES)]


def _size(moved: FloatArray) -> FloatArray:
    """Return the RMS displacement of each frame: (F,) [m]."""
    return np.sqrt((moved**2).sum(axis=2).mean(axis=1))


def _highest(curve: FloatArray, times: FloatArray, count: int, least: float) -> IntArray:
    """Return the highest local maxima of a curve over time."""
    apart = max(1, round(APART / float(np.median(np.diff(times)))))
    padded = np.concatenate([[-np.inf], curve, [-np.inf]])
    peaks, _ = find_peaks(padded, height=least, distance=apart)
    return (peaks - 1)[np.argsort(-curve[peaks - 1], kind="stable")[:count]]


def _rest(raw: FloatArray) -> Iterator[tuple[int, str]]:
    yield int(_size(raw).argmin()), "rest"


def _poses(mesh: Mesh, vertices: IntArray, raw: FloatArray) -> Iterator[tuple[int, str]]:
    """Yield for each region the frames farthest from rest, and from those before them."""
    regions = np.array(regions_of(mesh, vertices))
    for region in np.unique(regions):
        own = raw[:, regions == region]
        away = _size(own)
        for _ in range(POSES.get(str(region), FEW)):
            frame = int(away.argmax())
            if away[frame] < REST:
                break
            yield frame, str(region)
            away = np.minimum(away, _size(own - own[frame]))


def _corrections(
    raw: FloatArray, corrected: FloatArray, times: FloatArray
) -> Iterator[tuple[int, str]]:
    change = np.linalg.norm(corrected - raw, axis=2).max(axis=1)
    for frame in _highest(change, times, CORRECTIONS, REST):
        yield int(frame), "correction"


def _blinks(result: ShotResult) -> Iterator[tuple[int, str]]:
    """Yield the largest dips of the gap between the lids that are over soon."""
    mesh, times = result.shot.mesh, result.solved.times
    lids = find_lip_lid_contacts(mesh).lids
    if not len(lids):
        return
    moved = displacements(result, mesh, lids.ravel(), result.solved.weights)
    moved = moved.reshape(len(times), *lids.shape, 3)
    closing = (moved[:, :, 1, 1] - moved[:, :, 0, 1]).mean(axis=1)
    width = 2 * round(BLINK / float(np.median(np.diff(times)))) + 1
    for frame in _highest(closing - median_filter(closing, width), times, BLINKS, CLOSING):
        yield int(frame), "blink"


def _held(raw: FloatArray, times: FloatArray) -> Iterable[tuple[int, str]]:
    """Yield the middles of the longest poses that are held."""
    size = _size(raw)
    speed = _size(np.gradient(raw, times, axis=0))
    held = (size > 2 * REST) & (speed < STILL * size)
    spans = [span for span in _spans(held) if times[span[1]] - times[span[0]] >= HELD]
    spans.sort(key=lambda span: span[0] - span[1])
    return [((first + last) // 2, "held") for first, last in spans[:HELD_POSES]]


def _spans(where: BoolArray) -> list[tuple[int, int]]:
    """Return the first and last frame of each run of True."""
    edges = np.diff(np.concatenate([[0], where.astype(int), [0]]))
    ends = zip(np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1, strict=True)
    return [(int(first), int(last)) for first, last in ends]
