"""Other solvers on the same markers, with known head pose: functions of a `World` to weights.

Each frame is solved for itself, from the markers that it shows; only the Butterworth filter looks
at more than one. All but the textbook RBF start from the similarity delta.
"""

from collections.abc import Callable
from importlib.util import find_spec

import numpy as np
from scipy.optimize import lsq_linear, nnls
from scipy.signal import butter, filtfilt

from benchmarks.solve.worlds import METRES_PER_PIXEL, REST, World
from usdface.arrays import FloatArray
from usdface.geometry.rigid_fit import similarity_fit
from usdface.options import MapOptions
from usdface.retarget.rbf import fit_map
from usdface.retarget.solver.bounded_least_squares import solve_bounded

__all__ = ["BASELINES", "SAME"]

Solver = Callable[[World], FloatArray]

# Of the Audio2Face solver's form: L1 and L2, the size of its template [cm].
A2F_L1, A2F_L2, A2F_SIZE = 1.0, 3.5, 54.7


def similarity(world: World) -> FloatArray:
    """Carry displacements over by the best similarity: (F, M, 3), NaN where occluded."""
    if world.still.shape[2] == 2:  # they are given the size of a pixel
        return METRES_PER_PIXEL * (world.still[REST:] - world.neutral)
    linear, _ = similarity_fit(world.neutral, world.target.neutral)
    return (world.still[REST:] - world.neutral) @ linear


def frame_by_frame(
    world: World,
    displaced: FloatArray,
    solve: Callable[[FloatArray, FloatArray], FloatArray],
) -> FloatArray:
    """Solve the frames that show the same markers together, by ``solve(columns, rows)``."""
    axes = displaced.shape[2]
    offsets = world.target.offsets[..., :axes]
    seen = ~np.isnan(displaced[..., 0])
    patterns, which = np.unique(seen, axis=0, return_inverse=True)
    result = np.zeros((len(displaced), len(offsets)))
    for number, pattern in enumerate(patterns):
        rows = which.ravel() == number
        columns = offsets[:, pattern].reshape(len(offsets), -1).T
        result[rows] = solve(columns, displaced[rows][:, pattern].reshape(rows.sum(), -1))
    return result


def clipped(columns: FloatArray, rows: FloatArray) -> FloatArray:
    return np.clip(rows @ np.linalg.pinv(columns).T, 0, 1)


def nonnegative(columns: FloatArray, rows: FloatArray) -> FloatArray:
    return np.clip([nnls(columns, row)[0] for row in rows], 0, 1)


def bounded_least_squares(columns: FloatArray, rows: FloatArray) -> FloatArray:
    return np.array([lsq_linear(columns, row, (0, 1), "bvls").x for row in rows])


def daqp(columns: FloatArray, rows: FloatArray) -> FloatArray:
    import qpsolvers

    normal = columns.T @ columns
    size, scale = len(normal), len(normal) / normal.trace()
    normal, rights = scale * normal + 1e-12 * size * np.eye(size), scale * rows @ columns
    low, high = np.zeros(size), np.ones(size)
    solved = [qpsolvers.solve_qp(normal, -r, lb=low, ub=high, solver="daqp") for r in rights]
    return np.clip(solved, low, high)


def exact(columns: FloatArray, rows: FloatArray) -> FloatArray:
    normal = columns.T @ columns
    floor = 1e-12 * normal.trace() * np.eye(len(normal))
    return solve_bounded(normal + floor, rows @ columns)


def audio2face(columns: FloatArray, rows: FloatArray) -> FloatArray:
    """Minimise its regularised sum as its source states it, in cm, as if all skin had markers."""
    columns, rows = 100 * columns, 100 * rows
    size = len(columns[0])
    scale = (25 / A2F_SIZE) ** 2 * len(columns) / 3 / 9409
    normal = columns.T @ columns + scale * (
        0.25 * A2F_L1**2 * np.ones((size, size)) + 10 * A2F_L2 * np.eye(size)
    )
    # It minimises |A x - b|^2 over the box, A the normal matrix itself.
    return solve_bounded(normal @ normal + 1e-12 * np.eye(size), rows @ columns @ normal)


def butterworth(world: World) -> FloatArray:
    weights = frame_by_frame(world, similarity(world), exact)
    b, a = butter(2, min(0.99, 6.0 / (0.5 * world.target.rate)))
    return np.clip(filtfilt(b, a, weights, axis=0), 0, 1)


def textbook_rbf(world: World) -> FloatArray:
    space = fit_map(world.neutral, world.target.neutral, MapOptions(form="paper"))
    axes = world.still.shape[2]
    carried = space(world.still[REST:].reshape(-1, axes)).reshape(*world.still[REST:].shape[:2], 3)
    return frame_by_frame(world, (carried - world.target.neutral)[..., :axes], exact)


def each_frame(solve: Callable[[FloatArray, FloatArray], FloatArray]) -> Solver:
    return lambda world: frame_by_frame(world, similarity(world), solve)


# Other programs for the problem that "exact" solves.
SAME: dict[str, Solver] = {"lsq_linear": each_frame(bounded_least_squares)}
if find_spec("qpsolvers") and find_spec("daqp"):  # the extra "bench"
    SAME["daqp"] = each_frame(daqp)

BASELINES: dict[str, Solver] = {
    "textbook RBF, exact": textbook_rbf,
    "least squares, clipped": each_frame(clipped),
    "nnls, clipped": each_frame(nonnegative),
    "exact": each_frame(exact),
    **SAME,
    "exact + Butterworth 6 Hz": butterworth,
    "Audio2Face form": each_frame(audio2face),
}
