"""Frames of a result to look at: peaks, corrections, blinks, held poses, largest residuals."""

from collections.abc import Iterable, Iterator

import numpy as np
from scipy.ndimage import median_filter

from usdface.arguments import checked
from usdface.arrays import FloatArray, IntArray
from usdface.blend_shapes.vertex_evaluator import evaluator_of
from usdface.face.lip_lid_contacts import find_lip_lid_contacts
from usdface.face.regions import regions_of
from usdface.numerics.frame_ranges import frame_ranges
from usdface.numerics.local_maxima import local_maxima
from usdface.rigs import Mesh
from usdface.shot.shot import ShotResult
from usdface.takes import frame_step

__all__ = ["peak_frames", "sheet_frames"]

# Set by hand; they only decide which frames are drawn.
_VERTICES = 800  # of the skin that are evaluated
_APART = 0.4  # s; frames nearer to each other look alike
_REST = 0.0005  # m; a face that moves less rests, a correction that moves less is none
_BLINK = 0.3  # s, longest
_CLOSING = 0.001  # m, least of a blink, lid to lid
_HELD = 0.5  # s, least
_STILL = 0.1  # of the pose's size per second
_CORRECTIONS, _BLINKS, _HELD_POSES, _RESIDUALS = 4, 3, 2, 2
_POSES, _FEW = {"mouth": 4, "jaw": 4, "brows": 3}, 2  # of a region; of the others


def sheet_frames(result: ShotResult, count: int) -> dict[int, str]:
    """Return some frames in order, each with its reason: rest, largest correction, residual, poses.

    The first of each kind comes before the second of any.
    """
    ranked: dict[str, list[int]] = {}
    for frame, reason in _candidates(result):
        ranked.setdefault(reason, []).append(frame)
    times = result.solved.times
    found: dict[int, str] = {}
    rounds = range(max(map(len, ranked.values()), default=0))
    for number, reason in ((n, reason) for n in rounds for reason in ranked):
        if number < len(ranked[reason]) and len(found) < count:
            _add(found, ranked[reason][number], reason, times)
    return dict(sorted(found.items()))


@checked
def peak_frames(result: ShotResult) -> dict[int, str]:
    """Return all frames to look at in order, each with its reason.

    Parameters
    ----------
    result : ShotResult

    Returns
    -------
    dict of int to str
        Frame index to reasons: ``"rest"``, ``"correction"``, ``"blink"``, ``"residual"``, a region
        that moves farthest there, ``"held"``.

    Examples
    --------
    >>> result = usdface.process("examples/shot.usda").value
    >>> "residual" in ", ".join(usdface.peak_frames(result).values())
    True
    """
    found: dict[int, str] = {}
    for frame, reason in _candidates(result):
        _add(found, frame, reason, result.solved.times)
    return dict(sorted(found.items()))


def _candidates(result: ShotResult) -> Iterator[tuple[int, str]]:
    """Yield frames and their reasons, the most important of each first."""
    mesh, times = result.shot.mesh, result.solved.times
    vertices = _skin(mesh)
    raw = _displacements(result, mesh, vertices, result.solved.weights)
    corrected = _displacements(result, mesh, vertices, result.weights.weights)
    yield from _rest(raw)
    yield from _blinks(result)
    yield from _corrections(raw, corrected, times)
    if result.solution is not None:
        for frame in _highest(result.solution.residual, times, _RESIDUALS, 0.0):
            yield int(frame), "residual"
    yield from _poses(mesh, vertices, raw)
    yield from _held(raw, times)


def _add(found: dict[int, str], frame: int, reason: str, times: FloatArray) -> None:
    """Add a frame, or its reason to that of a frame near it, unless that is rest."""
    near = (other for other in found if abs(times[other] - times[frame]) < _APART)
    first = next((other for other in near if other == frame or found[other] != "rest"), None)
    if first is None:
        found[frame] = reason
    elif reason not in found[first]:
        found[first] += f", {reason}"


def _displacements(
    result: ShotResult, mesh: Mesh, vertices: IntArray, weights: FloatArray
) -> FloatArray:
    """Return displacements of vertices of the bound mesh, on a human face: (F, N, 3) [m]."""
    names = result.solved.names
    columns = [names.index(name) for name in mesh.shape_names]
    evaluator, _ = evaluator_of(mesh.shapes, vertices)
    moved = evaluator.displacements(evaluator.combined(weights[:, columns]))
    return moved.reshape(len(weights), len(vertices), 3) / result.shot.face.size


def _skin(mesh: Mesh) -> IntArray:
    """Return vertices that blend shapes move, evenly thinned out."""
    moved = np.unique(np.concatenate([shape.indices for shape in mesh.shapes]))
    return moved[:: max(1, len(moved) // _VERTICES)]


def _size(moved: FloatArray) -> FloatArray:
    """Return the RMS displacement of each frame: (F,) [m]."""
    return np.asarray(np.sqrt((moved**2).sum(axis=2).mean(axis=1)))


def _highest(curve: FloatArray, times: FloatArray, count: int, least: float) -> IntArray:
    """Return the highest local maxima of a curve over time."""
    apart = max(1, _frames(_APART, times))
    padded = np.concatenate([[-np.inf], curve, [-np.inf]])
    peaks = local_maxima(padded, least, apart) - 1
    return np.asarray(peaks[np.argsort(-curve[peaks], kind="stable")[:count]])


def _frames(lasting: float, times: FloatArray) -> int:
    """Return how many frames a time [s] is; 0 where there is but one."""
    return round(lasting / frame_step(times)) if len(times) > 1 else 0


def _rest(raw: FloatArray) -> Iterator[tuple[int, str]]:
    yield int(_size(raw).argmin()), "rest"


def _poses(mesh: Mesh, vertices: IntArray, raw: FloatArray) -> Iterator[tuple[int, str]]:
    """Yield for each region the frames farthest from rest, and from those before them."""
    regions = np.array(regions_of(mesh, vertices))
    for region in np.unique(regions):
        own = raw[:, regions == region]
        away = _size(own)
        for _ in range(_POSES.get(str(region), _FEW)):
            frame = int(away.argmax())
            if away[frame] < _REST:
                break
            yield frame, str(region)
            away = np.minimum(away, _size(own - own[frame]))


def _corrections(
    raw: FloatArray, corrected: FloatArray, times: FloatArray
) -> Iterator[tuple[int, str]]:
    change = np.linalg.norm(corrected - raw, axis=2).max(axis=1)
    for frame in _highest(change, times, _CORRECTIONS, _REST):
        yield int(frame), "correction"


def _blinks(result: ShotResult) -> Iterator[tuple[int, str]]:
    """Yield the largest short dips of the gap between the lids: blinks."""
    mesh, times = result.shot.mesh, result.solved.times
    lids = find_lip_lid_contacts(mesh).lids
    if not len(lids):
        return
    moved = _displacements(result, mesh, lids.ravel(), result.solved.weights)
    moved = moved.reshape(len(times), *lids.shape, 3)
    closing = (moved[:, :, 1, 1] - moved[:, :, 0, 1]).mean(axis=1)
    width = 2 * _frames(_BLINK, times) + 1
    for frame in _highest(closing - median_filter(closing, width), times, _BLINKS, _CLOSING):
        yield int(frame), "blink"


def _held(raw: FloatArray, times: FloatArray) -> Iterable[tuple[int, str]]:
    """Yield the middles of the longest poses that are held."""
    if len(times) == 1:
        return []
    size = _size(raw)
    speed = _size(np.gradient(raw, times, axis=0))
    held = (size > 2 * _REST) & (speed < _STILL * size)
    spans = [span for span in frame_ranges(held) if times[span[1]] - times[span[0]] >= _HELD]
    spans.sort(key=lambda span: span[0] - span[1])
    return [((first + last) // 2, "held") for first, last in spans[:_HELD_POSES]]
