"""Linear algebra on one thread while usdface computes, whoever calls it.

The libraries under numpy and scipy take every core for each product and wait for one another by
spinning. The solve has its own threads, one for each core, so they would only be in its way: beside
a program that keeps a core busy they wait for it at each product. And how a product is cut into
threads shows in its last bits: the same shot would give other bytes on a machine with more cores.

How many threads a library takes is a setting of the whole process. So the first caller to come in
stores the setting of the host, the last one to go out puts it back, and those between them, on
this thread or others, find one thread. Products of the host's other threads run on one thread
meanwhile; nothing else of theirs changes. Apple's Accelerate has no such setting: it listens to the
environment alone (`limit_from_start`).
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
_loaded: frozenset[str] = frozenset()
_before: dict[str, tuple[Any, int]] = {}  # by library: its controls, and the host's threads


def limit_from_start() -> None:
    """Limit libraries that are loaded from now on: for a process of our own, before its imports.

    They then start no threads at all; a number in the environment goes first.
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
        for library, _ in _before.values():
            _set_threads(library, 1)


def _limit() -> None:
    """Limit the libraries that have been loaded since they were last looked for."""
    global _loaded
    loaded = frozenset(name for name in _LOADERS if name in sys.modules)
    if loaded == _loaded:
        return
    from threadpoolctl import ThreadpoolController  # only where something is computed

    for library in ThreadpoolController().select(user_api="blas").lib_controllers:
        if library.filepath not in _before:
            _before[library.filepath] = library, library.num_threads
            _set_threads(library, 1)
    _loaded = loaded


def _set_threads(library: Any, threads: int) -> None:
    """Set it whichever thread asks.

    From 3.8 on threadpoolctl lets only the thread that first set OpenBLAS set it again, and is
    silent to others: a host that computes off its main thread would never be limited. Who comes
    first and last is counted here instead.
    """
    getattr(library, "_real_set_num_threads", library.set_num_threads)(threads)


def _leave() -> None:
    global _inside, _loaded
    _inside -= 1
    if _inside == 0:
        for library, threads in _before.values():
            _set_threads(library, threads)
        _before.clear()
        _loaded = frozenset()
