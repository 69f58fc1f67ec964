"""Backend of the inner loops of the solve: all cores, compiled if numba is installed."""

import importlib
import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from typing import Any, TypeVar

from usdface.blas_threads import limit_worker
from usdface.findings import Finding, finding
from usdface.progress import COMPILE, Progress

__all__ = ["compile_kernels", "kernels", "on_all_cores"]

# Frames times blend shapes squared below which loading numba (0.7 s of processor time) and, once on
# a machine, compiling (5 s) are not worth it. At 1.5 million a take, with some sixty such solves,
# takes 5.1 s with it and 6.3 s without (the example; medians of three, cores without AVX-512).
_WORTH = 2_000_000
# The same from which on a solve without numba takes more than 10 s longer, its rounds included:
# python benchmarks/process.py, 1.1 s at 11 million.
_SLOW = 100_000_000

_Item = TypeVar("_Item")


def kernels(frames: int, size: int) -> Any:
    """Return `usdface.retarget.solver.kernels` if numba is installed and worth loading, else None.

    Whether it is worth it depends on the problem alone, so that equal input has equal output.
    """
    if frames * size**2 < _WORTH:
        return None
    try:
        return importlib.import_module("usdface.retarget.solver.kernels")
    except (ImportError, RuntimeError):
        # RuntimeError: numba finds no writable cache folder, and would compile each time.
        return None


def compile_kernels(frames: int, size: int, progress: Progress) -> list[Finding]:
    """Load the compiled kernels; if numba must compile them first, that is a step of its own.

    Parameters
    ----------
    frames, size : int
        Of the solve that is to come.
    progress : Progress

    Returns
    -------
    list of Finding
        SOLVE_UNCOMPILED where the solve will take long without.
    """
    if frames * size**2 < _WORTH:
        return []
    with ExitStack() as compiling:
        try:
            from numba.core import event
        except ImportError:
            return _uncompiled(frames, size, "numba is not installed", missing="numba")

        class Listener(event.Listener):
            announced = False

            def on_start(self, _: Any) -> None:
                if not self.announced:
                    compiling.enter_context(progress.step(COMPILE))
                self.announced = True

            def on_end(self, _: Any) -> None:
                pass

        with event.install_listener("numba:compile", Listener()):
            if kernels(frames, size) is None:
                return _uncompiled(
                    frames,
                    size,
                    "numba finds no folder to keep machine code in; name one that can be written "
                    "to in NUMBA_CACHE_DIR",
                    missing="cache_folder",
                )
    return []


def _uncompiled(frames: int, size: int, why: str, *, missing: str) -> list[Finding]:
    if frames * size**2 < _SLOW:
        return []
    return [
        finding("SOLVE_UNCOMPILED", f"{frames} frames", why, missing=missing, frame_count=frames)
    ]


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
