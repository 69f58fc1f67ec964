"""The array types that all modules share, and immutable arrays."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["BoolArray", "FloatArray", "IntArray", "freeze", "frozen"]

# As NDArray, which hides the kind of number from `usdface.arguments` where it is a lazy alias
# (NumPy 2.5 and later).
FloatArray = np.ndarray[tuple[Any, ...], np.dtype[np.float64]]
IntArray = np.ndarray[tuple[Any, ...], np.dtype[np.int64]]
BoolArray = np.ndarray[tuple[Any, ...], np.dtype[np.bool_]]


def frozen(values: ArrayLike, dtype: Any = np.float64) -> NDArray[Any]:
    """Return a read-only, C-contiguous array of `values`; a read-only input is not copied."""
    array = np.ascontiguousarray(values, dtype=dtype)
    if array.flags.writeable:
        array = array.copy() if array is values or array.base is not None else array
        array.setflags(write=False)
    return array


def freeze(owner: object, *names: str, dtype: Any = np.float64) -> None:
    """Make arrays of a frozen dataclass `frozen`, in its `__post_init__`; None stays None."""
    for name in names:
        if (values := getattr(owner, name)) is not None:
            object.__setattr__(owner, name, frozen(values, dtype))
