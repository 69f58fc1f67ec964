"""The inner loops of the solve, compiled by numba: the arithmetic of the numpy forms, fused.

Imported by `usdface.retarget.solver.backend` only, where numba is installed. Machine code is kept
in the user's cache, ``~/.cache/usdface/compiled`` (``NUMBA_CACHE_DIR`` names another place). It is
made once, in five seconds, when a take that is long enough is solved for the first time, or by
``python -c "import usdface.retarget.solver.kernels"``.

One long file: numba does not notice when a function changes that compiled code calls in another.
"""

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba
import numpy as np

from usdface.arrays import BoolArray, FloatArray, IntArray
from usdface.user_cache import user_cache_folder

__all__ = ["alternate", "factorise", "pivot"]

# Unknowns are exchanged that violate their sign by this share of the worst; after this many rounds
# only the last one (Murty's rule), which always terminates.
_SHARE = 0.3
_ROUNDS = 60
# Relative residual to which a solution is refined; else the tableau is computed anew, as after this
# many exchanges.
_REFINED = 1e-12
_STALE = 1000
# Rows of the factor that differ by less, relatively, are shared; the effect is below 1e-9.
_SAME = 1e-13
_BLOCK = 8

_MATRIX, _CUBE, _VECTOR = "float64[:,::1]", "float64[:,:,::1]", "float64[::1]"
_FLAGS = "boolean[::1]"

_Function = TypeVar("_Function", bound=Callable[..., object])


def _compiled(signature: str, *, contract: bool = True) -> Callable[[_Function], _Function]:
    """Return the decorator that compiles a function, or takes it from the user's cache.

    numba's own choice is the folder of this file, where pip leaves machine code behind when it
    uninstalls: a folder without modules that hides an editable install.

    Parameters
    ----------
    signature : str
        Types of the result and the arguments.
    contract : bool
        Multiplications and additions may be fused.
    """
    fused = {"contract"} if contract else False
    config: Any = numba.config

    def decorate(function: _Function) -> _Function:
        before = config.CACHE_DIR
        config.CACHE_DIR = before or str(user_cache_folder("compiled") or "")
        try:
            compiled = numba.njit(signature, cache=True, nogil=True, fastmath=fused)(function)
        finally:
            config.CACHE_DIR = before
        return cast(_Function, compiled)

    return decorate


@_compiled(f"void({_MATRIX}, int64, {_VECTOR})")
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


@_compiled(
    f"void({_MATRIX}, int64, int64, {_VECTOR}, {_VECTOR})",
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


@_compiled(f"void({_VECTOR}, {_MATRIX}, {_VECTOR})")
def _multiply(vector: FloatArray, matrix: FloatArray, result: FloatArray) -> None:
    for j in range(len(matrix)):
        result[j] = 0.0
    for i in range(len(matrix)):
        value = vector[i]
        if value != 0.0:
            for j in range(len(matrix)):
                result[j] += value * matrix[i, j]


@_compiled(
    f"float64({_FLAGS}, {_FLAGS}, {_MATRIX}, {_MATRIX}, float64, {_MATRIX})",
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


@_compiled(
    f"void({_MATRIX}, {_MATRIX}, {_MATRIX}, {_MATRIX}, {_MATRIX}, {_FLAGS})",
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


@_compiled(f"Tuple(({_CUBE}, int64[::1]))({_MATRIX}, {_VECTOR})", contract=False)
def factorise(bands: FloatArray, values: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return L D L' of the pentadiagonal matrix plus each of `values`: (N, 3, S), (F,).

    The first holds 1 / D, and L's entries one and two frames back; the second which of its
    rows are a frame's. Evenly sampled takes need few rows: the factor soon stays as it is.
    """
    count, size = bands.shape[1], len(values)
    factor, rows = np.empty((count, 3, size)), np.zeros(count, np.int64)
    used = 0
    for t in range(count):
        even, largest = t > 2, 1e-300
        for b in range(3):
            largest = max(largest, abs(bands[b, t]))
        for b in range(3):
            even = even and abs(bands[b, t] - bands[b, t - 1]) <= _SAME * largest
        if even and rows[t - 1] == rows[t - 2]:
            rows[t] = rows[t - 1]
            continue
        last, earlier = rows[t - 1], rows[t - 2]
        same = even
        for k in range(size):
            diagonal = bands[2, t] + values[k]
            one = two = 0.0
            if t > 1:
                two = bands[0, t] * factor[earlier, 0, k]
                diagonal -= two * bands[0, t]
            if t > 0:
                # The rest of the entry between this frame and the one before.
                between = bands[1, t]
                if t > 1:
                    between -= bands[0, t] * factor[last, 1, k]
                one = between * factor[last, 0, k]
                diagonal -= one * between
            factor[used, 0, k], factor[used, 1, k], factor[used, 2, k] = 1.0 / diagonal, one, two
            same = same and abs(diagonal * factor[last, 0, k] - 1.0) <= _SAME
            same = same and abs(one - factor[last, 1, k]) <= _SAME
        if same:
            rows[t] = last
        else:
            rows[t] = used
            used += 1
    return factor[:used], rows


@_compiled(
    f"void({_MATRIX}, {_MATRIX}, {_MATRIX}, int64, int64)",
)
def _add_product(
    left: FloatArray, matrix: FloatArray, result: FloatArray, first: int, count: int
) -> None:
    """Add ``left[:count] @ matrix`` to rows `first` and on of `result`.

    Four rows at a time, four of the matrix: sixteen factors stay in registers. Both counts are
    multiples of four.
    """
    for f in range(0, count, 4):
        t = first + f
        for r in range(0, len(matrix), 4):
            a0, a1, a2, a3 = left[f, r], left[f, r + 1], left[f, r + 2], left[f, r + 3]
            g = f + 1
            b0, b1, b2, b3 = left[g, r], left[g, r + 1], left[g, r + 2], left[g, r + 3]
            g = f + 2
            c0, c1, c2, c3 = left[g, r], left[g, r + 1], left[g, r + 2], left[g, r + 3]
            g = f + 3
            d0, d1, d2, d3 = left[g, r], left[g, r + 1], left[g, r + 2], left[g, r + 3]
            for k in range(matrix.shape[1]):
                m0, m1 = matrix[r, k], matrix[r + 1, k]
                m2, m3 = matrix[r + 2, k], matrix[r + 3, k]
                result[t, k] += a0 * m0 + a1 * m1 + a2 * m2 + a3 * m3
                result[t + 1, k] += b0 * m0 + b1 * m1 + b2 * m2 + b3 * m3
                result[t + 2, k] += c0 * m0 + c1 * m1 + c2 * m2 + c3 * m3
                result[t + 3, k] += d0 * m0 + d1 * m1 + d2 * m2 + d3 * m3


@_compiled(
    f"int64({_CUBE}, int64[::1], {_MATRIX}, {_MATRIX}, {_MATRIX}, {_MATRIX}, {_MATRIX}, {_MATRIX},"
    f" {_MATRIX}, int64, float64, float64)",
)
def alternate(
    factor: FloatArray,
    rows: IntArray,
    rotation: FloatArray,
    back: FloatArray,
    constant: FloatArray,
    low: FloatArray,
    high: FloatArray,
    boxed: FloatArray,
    dual: FloatArray,
    iterations: int,
    relaxation: float,
    tolerance: float,
) -> int:
    """Do iterations of `temporal_solve`; `boxed` and `dual` (F, R) are written to.

    `rotation` is (R, S), `back` (S, R), `constant` (F, S), `low` and `high` (F, R), or (1, R)
    if they are alike in all frames. S and R are padded to multiples of four by the caller. Returns
    how many iterations were done.
    """
    count, size = constant.shape
    wide = boxed.shape[1]
    rotated = np.zeros((count + 3, size))
    left, relaxed = np.zeros((_BLOCK, wide)), np.zeros((_BLOCK, wide))
    ahead = np.zeros((_BLOCK, size))
    for done in range(1, iterations + 1):
        for first in range(0, count, _BLOCK):
            here = min(_BLOCK, count - first)
            for f in range(here):
                t = first + f
                for r in range(wide):
                    left[f, r] = boxed[t, r] - dual[t, r]
                for k in range(size):
                    rotated[t, k] = constant[t, k]
            _add_product(left, rotation, rotated, first, here + -here % 4)
            for t in range(first, first + here):
                own = factor[rows[t]]
                if t > 0:
                    for k in range(size):
                        rotated[t, k] -= own[1, k] * rotated[t - 1, k]
                if t > 1:
                    for k in range(size):
                        rotated[t, k] -= own[2, k] * rotated[t - 2, k]
        largest = 0.0
        for first in range((count - 1) // _BLOCK * _BLOCK, -1, -_BLOCK):
            here = min(_BLOCK, count - first)
            for t in range(first + here - 1, first - 1, -1):
                own = factor[rows[t], 0]
                for k in range(size):
                    rotated[t, k] *= own[k]
                if t < count - 1:
                    own = factor[rows[t + 1], 1]
                    for k in range(size):
                        rotated[t, k] -= own[k] * rotated[t + 1, k]
                if t < count - 2:
                    own = factor[rows[t + 2], 2]
                    for k in range(size):
                        rotated[t, k] -= own[k] * rotated[t + 2, k]
                for k in range(size):
                    ahead[t - first, k] = relaxation * rotated[t, k]
                for r in range(wide):
                    relaxed[t - first, r] = (1.0 - relaxation) * boxed[t, r] + dual[t, r]
            _add_product(ahead, back, relaxed, 0, here + -here % 4)
            for f in range(here):
                t = first + f
                least, most = low[t if len(low) > 1 else 0], high[t if len(high) > 1 else 0]
                for r in range(wide):
                    clipped = min(max(relaxed[f, r], least[r]), most[r])
                    largest = max(largest, abs(clipped - boxed[t, r]))
                    boxed[t, r] = clipped
                    dual[t, r] = relaxed[f, r] - clipped
        if largest <= tolerance:
            return done
    return iterations
