"""Bounded least squares by principal pivoting, frame by frame: see `bounded_least_squares`.

One file: numba does not notice when a function changes that compiled code calls in another.
"""

import numpy as np

from usdface.arrays import BoolArray, FloatArray
from usdface.retarget.solver.kernels.compiled import FLAGS, MATRIX, VECTOR, compiled

__all__ = ["pivot"]

# Unknowns are exchanged that violate their sign by this share of the worst; after this many rounds
# only the last one (Murty's rule), which always terminates.
_SHARE = 0.3
_ROUNDS = 60
# Relative residual to which a solution is refined; else the tableau is computed anew, as after this
# many exchanges.
_REFINED = 1e-12
_STALE = 1000


@compiled(f"void({MATRIX}, int64, {VECTOR})")
def _exchange(tableau: FloatArray, p: int, row: FloatArray) -> None:
    """Exchange unknown p with its equation in ``y = x T`` (principal pivot, Tucker 1960)."""
    inverse = 1.0 / tableau[p, p]
    for j in range(len(tableau)):
        row[j] = tableau[p, j] * inverse
        tableau[p, j] = 0.0
    row[p] = inverse
    for i in range(len(tableau)):
        factor = tableau[i, p]
        if factor != 0.0:
            tableau[i, p] = 0.0
            for j in range(len(tableau)):
                tableau[i, j] -= factor * row[j]
    for j in range(len(tableau)):
        tableau[p, j] = row[j]


@compiled(
    f"void({MATRIX}, int64, int64, {VECTOR}, {VECTOR})",
)
def _exchange_two(
    tableau: FloatArray, p: int, q: int, first: FloatArray, second: FloatArray
) -> None:
    """Exchange p, then q, in one pass over the tableau."""
    size = len(tableau)
    inverse = 1.0 / tableau[p, p]
    for j in range(size):
        first[j] = tableau[p, j] * inverse
    first[p] = inverse
    factor = tableau[q, p]
    tableau[q, p] = 0.0
    for j in range(size):
        second[j] = tableau[q, j] - factor * first[j]
    inverse = 1.0 / second[q]
    for j in range(size):
        second[j] *= inverse
        tableau[p, j] = 0.0
        tableau[q, j] = 0.0
    second[q] = inverse
    between = first[q]
    for i in range(size):
        one = tableau[i, p]
        two = tableau[i, q] - one * between
        if one != 0.0 or two != 0.0:
            tableau[i, p] = 0.0
            tableau[i, q] = one * between
            for j in range(size):
                tableau[i, j] -= one * first[j] + two * second[j]
    first[q] = 0.0
    for j in range(size):
        tableau[p, j] = first[j] - between * second[j]
        tableau[q, j] = second[j]


@compiled(f"void({VECTOR}, {MATRIX}, {VECTOR})")
def _multiply(vector: FloatArray, matrix: FloatArray, result: FloatArray) -> None:
    for j in range(len(matrix)):
        result[j] = 0.0
    for i in range(len(matrix)):
        value = vector[i]
        if value != 0.0:
            for j in range(len(matrix)):
                result[j] += value * matrix[i, j]


@compiled(
    f"float64({FLAGS}, {FLAGS}, {MATRIX}, {MATRIX}, float64, {MATRIX})",
    contract=False,
)
def _disagreement(
    free: BoolArray,
    high: BoolArray,
    tableau: FloatArray,
    limits: FloatArray,
    tolerance: float,
    state: FloatArray,
) -> float:
    """Write the violation of each unknown; return the largest.

    `limits` holds lower, upper and right of the frame, `state` values, slopes and the answer.
    """
    worst = 0.0
    for i in range(len(free)):
        amount = 0.0
        if free[i]:
            amount = max(limits[0, i] - state[0, i], state[0, i] - limits[1, i]) - tolerance
        elif limits[0, i] < limits[1, i]:
            slope = state[1, i] if high[i] else -state[1, i]
            amount = (slope - tolerance) / tableau[i, i]
        state[2, i] = amount
        worst = max(worst, amount)
    return worst


@compiled(
    f"void({MATRIX}, {MATRIX}, {MATRIX}, {MATRIX}, {MATRIX}, {FLAGS})",
)
def pivot(
    matrix: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    right: FloatArray,
    solution: FloatArray,
    settled: BoolArray,
) -> None:
    """Solve the rows of a bounded least-squares problem, each from where the one before ends.

    The tableau is updated for the unknowns that become free or active, so that the cost of a frame
    is in proportion to its difference from the one before. Rows that did not settle are left False
    in `settled`.
    """
    count, size = right.shape
    tableau = matrix.copy()
    row, other = np.empty(size), np.empty(size)
    todo = np.empty(size, np.int64)
    exchanged = np.zeros(size, np.bool_)  # in the tableau
    free, high = np.zeros(size, np.bool_), np.zeros(size, np.bool_)
    limits, state = np.empty((3, size)), np.empty((3, size))
    known, step = np.empty(size), np.empty(size)
    age = 0
    for t in range(count):
        fresh, scale = False, 1.0
        for i in range(size):
            limits[0, i], limits[1, i], limits[2, i] = lower[t, i], upper[t, i], right[t, i]
            scale = max(scale, 1.0 + abs(right[t, i]))
            free[i] &= lower[t, i] < upper[t, i]
            high[i] &= upper[t, i] < np.inf
        tolerance = 1e-12 * scale
        for rounds in range(100 * size):
            if age > _STALE:
                for i in range(size):
                    exchanged[i] = False
                    for j in range(size):
                        tableau[i, j] = matrix[i, j]
                age = 0
            changes = 0
            for i in range(size):
                if exchanged[i] != free[i]:
                    exchanged[i] = free[i]
                    todo[changes] = i
                    changes += 1
                known[i] = limits[2, i] if free[i] else limits[1 if high[i] else 0, i]
            age += changes
            for c in range(0, changes - 1, 2):
                _exchange_two(tableau, todo[c], todo[c + 1], row, other)
            if changes % 2:
                _exchange(tableau, todo[changes - 1], row)
            _multiply(known, tableau, state[0])
            for i in range(size):
                state[1, i] = 0.0 if free[i] else state[0, i] - limits[2, i]
                if not free[i]:
                    state[0, i] = known[i]
            worst = _disagreement(free, high, tableau, limits, tolerance, state)
            if worst <= 0.0:
                # Solved by the tableau: refine it by the original equations.
                before, error = np.inf, np.inf
                while True:
                    _multiply(state[0], matrix, state[1])
                    error = 0.0
                    for i in range(size):
                        state[1, i] -= limits[2, i]
                        known[i] = -state[1, i] if free[i] else 0.0
                        error = max(error, abs(known[i]))
                    if error <= 1e-15 * scale or error > 0.25 * before:
                        break
                    before = error
                    _multiply(known, tableau, step)
                    for i in range(size):
                        state[0, i] += step[i] if free[i] else 0.0
                worst = _disagreement(free, high, tableau, limits, 10.0 * tolerance, state)
                if error <= _REFINED * scale and worst <= 0.0:
                    settled[t] = True
                    break
                if fresh:
                    break
                age, fresh = _STALE + 1, True
            last = -1
            for i in range(size):
                last = i if state[2, i] > 0.0 else last
            for i in range(size):
                amount = state[2, i]
                if amount > 0.0 and (amount >= _SHARE * worst if rounds < _ROUNDS else i == last):
                    high[i] = free[i] and state[0, i] > limits[1, i]
                    free[i] = not free[i]
        for i in range(size):
            solution[t, i] = state[0, i]
