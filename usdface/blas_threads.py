"""Linear algebra on one thread while usdface computes, also within a host application.

BLAS libraries of numpy and scipy use every core for each product, with spinning waits. The solve
has its own threads, one for each core, so these would compete with it: beside a program that keeps
a core busy they wait for it at each product. The split of a product into threads also changes its
last bits: the same shot would give other bytes on a machine with more cores.

The number of threads of a library is a setting of the whole process. So the first caller stores the
setting of the host and the last one restores it; calls between them, on any thread, use one thread.
Products of the host's other threads run on one thread meanwhile; nothing else of theirs changes.
Apple's Accelerate has no such setting, only environment variables (`limit_from_start`).
"""

import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

__all__ = ["BLAS_THREADS", "limit_from_start", "limit_worker", "one_blas_thread"]

# OpenBLAS (numpy's and scipy's wheels), Intel's MKL, Apple's Accelerate.
BLAS_THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
# The modules that load a library of linear algebra; wheels of the two have one each.
_LOADERS = ("numpy", "scipy.linalg._fblas")

_lock = threading.RLock()
_inside = 0
# Controls of the libraries that these loaded: they stay in a process; looking takes milliseconds.
_loaded: frozenset[str] = frozenset()
_found: dict[str, Any] = {}
_before: dict[str, int] = {}  # the host's number of threads, of each library that is limited


def limit_from_start() -> None:
    """Limit libraries that are loaded from now on: for a process of our own, before its imports.

    They then start no threads at all; a number in the environment takes precedence.
    """
    for name in BLAS_THREADS:
        os.environ.setdefault(name, "1")


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Run a block, or as a decorator a function, with linear algebra on one thread.

    The setting of the host comes back at the end, also after an exception. Blocks may be nested,
    and entered from several threads at once.
    """
    global _inside
    with _lock:
        _inside += 1
    try:
        with _lock:
            _limit()
        yield
    finally:
        with _lock:
            _leave()


def limit_worker() -> None:
    """Set it for a thread that a limited block has started, as some libraries count by thread.

    OpenBLAS with OpenMP, and BLIS: conda and Linux distributions have them.
    """
    with _lock:
        for name in _before:
            _set_threads(_found[name], 1)


def _limit() -> None:
    """Limit the libraries that are not yet limited."""
    _find()
    for name, library in _found.items():
        if name not in _before:
            _before[name] = library.num_threads
            _set_threads(library, 1)


def _find() -> None:
    """Look for libraries where one can have been loaded since."""
    global _loaded
    loaded = frozenset(name for name in _LOADERS if name in sys.modules)
    if loaded == _loaded:
        return
    from threadpoolctl import ThreadpoolController  # only where something is computed

    for library in ThreadpoolController().select(user_api="blas").lib_controllers:
        _found.setdefault(library.filepath, library)
    _loaded = loaded


def _set_threads(library: Any, threads: int) -> None:
    """Set it from any thread.

    From 3.8 on threadpoolctl lets only the thread that first set OpenBLAS set it again, and
    silently ignores others: a host that computes off its main thread would never be limited. The
    first and last caller are counted here instead.
    """
    getattr(library, "_real_set_num_threads", library.set_num_threads)(threads)


def _leave() -> None:
    global _inside
    _inside -= 1
    if _inside == 0:
        for name, threads in _before.items():
            _set_threads(_found[name], threads)
        _before.clear()
