"""Where the inner loops of the solve run: on all cores, and compiled if numba is installed."""

import importlib
import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

from usdface.blas_threads import limit_worker

__all__ = ["kernels", "on_all_cores"]

# Below this many weights times blend shapes numpy is done before numba is loaded.
_WORTH = 6_000_000

_Item = TypeVar("_Item")


def kernels(frames: int, size: int) -> Any:
    """Return `usdface.retarget.kernels` if it is there and worth loading for a solve, else None.

    What is worth it depends on the problem alone, so that equal input has equal output.
    """
    if frames * size**2 < _WORTH:
        return None
    try:
        return importlib.import_module("usdface.retarget.kernels")
    except (ImportError, RuntimeError):
        # RuntimeError: numba finds no place to keep machine code, and would compile each time.
        return None


def on_all_cores(function: Callable[[_Item], None], items: Iterable[_Item]) -> None:
    """Call a function that releases the GIL (numpy, compiled code) for each item."""
    items = list(items)
    workers = min(len(items), os.cpu_count() or 1)
    if workers < 2:
        for item in items:
            function(item)
        return
    with ThreadPoolExecutor(workers, initializer=limit_worker) as pool:
        for _ in pool.map(function, items):
            pass
