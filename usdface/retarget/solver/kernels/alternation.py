"""Iterations over all frames of a take: see `temporal_solve`.

One file: numba does not notice when a function changes that compiled code calls in another.
"""

import numpy as np

from usdface.arrays import FloatArray, IntArray
from usdface.retarget.solver.kernels.compiled import CUBE, MATRIX, VECTOR, compiled

__all__ = ["alternate", "factorise"]

# Rows of the factor that differ by less, relatively, are shared; the effect is below 1e-9.
_SAME = 1e-13
_BLOCK = 8


@compiled(f"Tuple(({CUBE}, int64[::1]))({MATRIX}, {VECTOR})", contract=False)
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


@compiled(
    f"void({MATRIX}, {MATRIX}, {MATRIX}, int64, int64)",
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


@compiled(
    f"int64({CUBE}, int64[::1], {MATRIX}, {MATRIX}, {MATRIX}, {MATRIX}, {MATRIX}, {MATRIX},"
    f" {MATRIX}, int64, float64, float64)",
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
