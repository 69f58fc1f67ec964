"""Points far off from all others, such as one that was dragged distances by mistake."""

import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.findings.values import Prose

__all__ = ["stray_move", "stray_point", "stray_points", "usual_size"]

# Points are stray beyond a gap in which the distance from the middle grows by this factor (a body
# below a face reaches 3 times as far) ...
_GAP = 4.0
# ... and if they are no more than this share of all: more are a part of the mesh. Both set by hand.
_FEW = 0.05


def _distances(points: FloatArray) -> FloatArray:
    middle = np.median(points, axis=0) if len(points) else np.zeros(3)
    return np.asarray(np.linalg.norm(points - middle, axis=1))


# Template and values of a finding
Stray = tuple[str, int, Prose, float] | tuple[()]


def stray_points(points: FloatArray) -> BoolArray:
    """Return which of some points (N, 3) lie far off: (N,).

    A few, many times as far from the middle of all (the median) as the farthest of the others.
    """
    distances = _distances(points)
    limit = _last_before_gap(distances)
    return np.asarray(distances > limit) if limit > 0.0 else np.zeros(len(points), dtype=bool)


def usual_size(points: FloatArray) -> float:
    """Return the diameter about the middle of points (N, 3) that are not stray; 0 for none."""
    return 2.0 * float(_distances(points)[~stray_points(points)].max(initial=0.0))


def stray_point(points: FloatArray) -> Stray:
    """Return which of some points (N, 3) lie far off; () if none does."""
    stray = np.flatnonzero(stray_points(points))
    if not len(stray):
        return ()
    distances = _distances(points)
    far = int(distances.argmax())
    times = 2.0 * float(distances[far]) / usual_size(points)
    message = (
        "point {point}{more} lies far off, {ratio:.3g} times as far from the middle as the others"
    )
    return message, far, _more(len(stray)), times


def stray_move(offsets: FloatArray, indices: IntArray, points: FloatArray) -> Stray:
    """Return how a shape drags a few points off a mesh; () if it does not.

    Farther than the mesh is large, and many times as far as it moves any other.

    Parameters
    ----------
    offsets : (N, 3) float64
    indices : (N,) int64
        The points that they move.
    points : (V, 3) float64
        All points of the mesh; none where they are not known.
    """
    length = np.zeros(max(len(points), len(offsets)))
    length[: len(offsets)] = np.linalg.norm(offsets, axis=1)
    size = usual_size(points)
    limit = _last_before_gap(length, size) if size > 0.0 else np.inf
    beyond = int((length > limit).sum())
    if not beyond:
        return ()
    far = int(length.argmax())
    message = "point {point}{more} moves by {ratio:.3g} times the mesh's size"
    return message, indices[far], _more(beyond), length[far] / size


def _more(count: int) -> Prose:
    return Prose(f" and {count - 1} more" if count > 1 else "")


def _last_before_gap(distances: FloatArray, least: float = 0.0) -> float:
    """Return the largest of some distances before the gap that parts a few; infinite without one.

    Beyond the gap they are more than `least`.
    """
    few = int(_FEW * len(distances))
    if not few:
        return np.inf
    farthest = np.sort(distances)[-few - 1 :]
    gaps = np.flatnonzero(farthest[1:] > np.maximum(_GAP * farthest[:-1], least))
    return float(farthest[gaps[0]]) if len(gaps) else np.inf
